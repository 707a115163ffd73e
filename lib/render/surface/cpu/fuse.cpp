#include "lib/render/surface/cpu/fuse.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "lib/render/surface/votes.hpp"

namespace stx::surface {
namespace {

std::uint32_t bitsOf(float q) {
    return std::bit_cast<std::uint32_t>(q) & 3u;
}

/// Least and greatest sample, and all remarks, of each pixel of a row, S x S samples in each.
template <int S>
void summarisePixels(const float* lines, int stride, float* low, float* high,
                     std::uint32_t* remarks) {
    for (int x = 0; x < kTile; ++x) {
        float least = lines[x * S], most = least;
        std::uint32_t bits = 0;
        for (int j = 0; j < S; ++j) {
            for (int i = 0; i < S; ++i) {
                const float q = lines[j * stride + x * S + i];
                least = std::min(least, q);
                most = std::max(most, q);
                bits |= std::bit_cast<std::uint32_t>(q);
            }
        }
        low[x] = least;
        high[x] = most;
        remarks[x] = bits;
    }
}

struct Fuser {
    std::span<const LocalSource> sources;
    const SampleGrid& grid;
    const DepthAxis& axis;
    int tileX, tileY;
    Pieces& pieces;
    float step;  ///< coarsest depth code of the sources, scene units

    struct Candidate {
        float q;
        int source;
    };
    struct Accepted {
        float q = 0;
        std::uint32_t sources = 0;
        int sample = 0;
    };

    /// Surfaces that lie no further apart than this in q are one.
    [[nodiscard]] float same(float q) const {
        return kSame * axis.whole(q) + step * axis.perUnit(q);
    }

    [[nodiscard]] float sampleOf(int source, int i, int j) const {
        const float* samples = sources[static_cast<std::size_t>(source)].samples;
        return samples ? samples[static_cast<std::ptrdiff_t>(j) * grid.stride() + i] : 0.0f;
    }

    /// dq/dx, dq/dy per pixel of one source's surface at a sample.
    [[nodiscard]] glm::vec2 slope(int source, int i, int j) const {
        const float here = sampleOf(source, i, j);
        const float limit = kLinkedSamples * axis.whole(here);
        const auto difference = [&](int di, int dj, float& out) {
            const int ni = i + di, nj = j + dj;
            if (ni < 0 || nj < 0 || ni >= grid.side() || nj >= grid.side()) return false;
            const float there = sampleOf(source, ni, nj);
            out = (there - here) * static_cast<float>(di + dj);
            return there > 0.0f && std::abs(out) < limit;
        };
        const auto along = [&](int di, int dj) {
            float a = 0, b = 0;
            const bool hasA = difference(-di, -dj, a), hasB = difference(di, dj, b);
            if (hasA && hasB) {
                if (std::abs(a) < 0.5f * std::abs(b)) return a;
                if (std::abs(b) < 0.5f * std::abs(a)) return b;
                return 0.5f * (a + b);
            }
            return hasA ? a : hasB ? b : 0.0f;
        };
        return glm::vec2(along(1, 0), along(0, 1)) * static_cast<float>(grid.perPixel);
    }

    /// The same of a pixel whose samples are all of one surface; (i, j) is its first.
    [[nodiscard]] glm::vec2 slopeInside(int source, int i, int j) const {
        const int S = grid.perPixel, stride = grid.stride();
        const float* at = sources[static_cast<std::size_t>(source)].samples +
                          static_cast<std::ptrdiff_t>(j) * stride + i;
        const float scale = static_cast<float>(S) / static_cast<float>(S - 1);
        const float* row = at + static_cast<std::ptrdiff_t>(S / 2) * stride;
        const float* column = at + S / 2;
        return glm::vec2(row[S - 1] - row[0],
                         column[static_cast<std::ptrdiff_t>(S - 1) * stride] - column[0]) *
               scale;
    }

    [[nodiscard]] bool rejected(const Candidate& c, float x, float y, int i, int j) const {
        const std::uint32_t bits = bitsOf(c.q);
        const int enough = (bits & kNearEdgeBit) ? 1 : 2;
        int votes = 0;
        for (int s = 0; s < static_cast<int>(sources.size()); ++s) {
            const LocalSource& local = sources[static_cast<std::size_t>(s)];
            if (s == c.source) {
                if (!local.source->hasAlpha || !(bits & kNearEdgeBit)) continue;
                const glm::vec4 h = local.sourceFromPixel.homogeneous(x, y, c.q);
                if (alphaAt(*local.source,
                            std::clamp(h.x / h.w, 0.0f, static_cast<float>(local.source->width)),
                            std::clamp(h.y / h.w, 0.0f, static_cast<float>(local.source->height))) <
                    local.source->freeAlpha)
                    return true;
                continue;
            }
            const float other = sampleOf(s, i, j);
            if (other > 0.0f && !(bitsOf(other) & kExtensionBit) &&
                std::abs(other - c.q) < same(c.q))
                continue;
            switch (opinionOf(*local.source, local.sourceFromPixel, x, y, c.q)) {
                case Opinion::none:
                    break;
                case Opinion::freeByAlpha:
                    return true;
                case Opinion::freeByDepth:
                    if (++votes >= enough) return true;
                    break;
            }
        }
        return false;
    }

    [[nodiscard]] bool fuseSample(int i, int j, Accepted& out) const {
        std::array<Candidate, 32> candidates;
        int count = 0;
        for (int s = 0; s < static_cast<int>(sources.size()); ++s) {
            const float q = sampleOf(s, i, j);
            if (!(q > 0.0f)) continue;
            int at = count++;
            for (; at > 0 && candidates[static_cast<std::size_t>(at - 1)].q < q; --at)
                candidates[static_cast<std::size_t>(at)] =
                    candidates[static_cast<std::size_t>(at - 1)];
            candidates[static_cast<std::size_t>(at)] = {q, s};
        }
        const float scale = 1.0f / static_cast<float>(grid.perPixel);
        const float x = static_cast<float>(tileX) + (static_cast<float>(i) + 0.5f) * scale;
        const float y = static_cast<float>(tileY) + (static_cast<float>(j) + 0.5f) * scale;
        for (int c = 0; c < count; ++c) {
            const Candidate& front = candidates[static_cast<std::size_t>(c)];
            const float behind = front.q - same(front.q);
            bool sure = false;
            if (bitsOf(front.q) == 0) {
                for (int o = c + 1; o < count && candidates[static_cast<std::size_t>(o)].q > behind;
                     ++o)
                    sure = sure || bitsOf(candidates[static_cast<std::size_t>(o)].q) == 0;
            }
            if (!sure && rejected(front, x, y, i, j)) continue;
            float sum = 0, weights = 0;
            std::uint32_t meshes = 0, extensions = 0;
            for (int o = c; o < count && candidates[static_cast<std::size_t>(o)].q > behind; ++o) {
                const Candidate& other = candidates[static_cast<std::size_t>(o)];
                const bool extension = bitsOf(other.q) & kExtensionBit;
                const float weight = extension ? kExtensionWeight : 1.0f;
                sum += weight * (other.q - front.q);
                weights += weight;
                (extension ? extensions : meshes) |= 1u << other.source;
            }
            out.q = front.q + sum / weights;
            out.sources = meshes ? meshes : extensions;
            return true;
        }
        return false;
    }

    void fusePixel(int column, int row) const {
        const int S = grid.perPixel;
        std::array<Accepted, 16> samples;
        int count = 0;
        for (int j = 0; j < S; ++j) {
            for (int i = 0; i < S; ++i) {
                Accepted a;
                if (!fuseSample(column * S + i, row * S + j, a)) continue;
                a.sample = j * S + i;
                int at = count++;
                for (; at > 0 && samples[static_cast<std::size_t>(at - 1)].q < a.q; --at)
                    samples[static_cast<std::size_t>(at)] =
                        samples[static_cast<std::size_t>(at - 1)];
                samples[static_cast<std::size_t>(at)] = a;
            }
        }
        const float scale = 1.0f / static_cast<float>(S);
        for (int begin = 0; begin < count;) {
            int end = begin + 1;
            while (end < count) {
                const float before = samples[static_cast<std::size_t>(end - 1)].q;
                if (before - samples[static_cast<std::size_t>(end)].q >
                    kJump * axis.whole(before) + step * axis.perUnit(before))
                    break;
                ++end;
            }
            float x = 0, y = 0, q = 0;
            std::uint32_t seenBy = 0;
            for (int k = begin; k < end; ++k) {
                const Accepted& a = samples[static_cast<std::size_t>(k)];
                x += (static_cast<float>(a.sample % S) + 0.5f) * scale;
                y += (static_cast<float>(a.sample / S) + 0.5f) * scale;
                q += a.q;
                seenBy |= a.sources;
            }
            const float n = 1.0f / static_cast<float>(end - begin);
            const Accepted& middle = samples[static_cast<std::size_t>((begin + end) / 2)];
            const glm::vec2 g = slope(std::countr_zero(middle.sources),
                                      column * S + middle.sample % S, row * S + middle.sample / S);
            pieces.add(static_cast<float>(tileX + column) + x * n,
                       static_cast<float>(tileY + row) + y * n, q * n, g.x, g.y,
                       static_cast<float>(end - begin) * scale * scale, seenBy,
                       row * kTile + column);
            begin = end;
        }
    }

    void fuseRow(int row, int columns) {
        const int S = grid.perPixel;
        // Per source and pixel: the range of its samples and all their remarks.
        std::array<std::array<float, kTile>, 32> low, high;
        std::array<std::array<std::uint32_t, kTile>, 32> remarks;
        for (std::size_t s = 0; s < sources.size(); ++s) {
            if (!sources[s].samples) continue;
            const float* lines =
                sources[s].samples + static_cast<std::ptrdiff_t>(row) * S * grid.stride();
            constexpr std::array summarise = {summarisePixels<1>, summarisePixels<2>,
                                              summarisePixels<3>, summarisePixels<4>};
            summarise[static_cast<std::size_t>(S - 1)](lines, grid.stride(), low[s].data(),
                                                       high[s].data(), remarks[s].data());
        }
        for (int column = 0; column < columns; ++column) {
            const auto k = static_cast<std::size_t>(column);
            bool simple = true, any = false;
            std::uint32_t present = 0;
            float sum = 0, lowMean = std::numeric_limits<float>::max(), highMean = 0;
            int first = -1;
            for (std::size_t s = 0; s < sources.size(); ++s) {
                if (!sources[s].samples || !(high[s][k] > 0.0f)) continue;
                any = true;
                if (!(low[s][k] > 0.0f) || (remarks[s][k] & 3u) ||
                    high[s][k] - low[s][k] > kOneSurface * axis.whole(high[s][k])) {
                    simple = false;
                    break;
                }
                const float mean = 0.5f * (high[s][k] + low[s][k]);
                lowMean = std::min(lowMean, mean);
                highMean = std::max(highMean, mean);
                sum += mean;
                present |= 1u << s;
                if (first < 0) first = static_cast<int>(s);
            }
            if (!any) continue;
            if (!simple || highMean - lowMean > same(highMean)) {
                fusePixel(column, row);
                continue;
            }
            const int count = std::popcount(present);
            const float x = static_cast<float>(tileX + column) + 0.5f;
            const float y = static_cast<float>(tileY + row) + 0.5f;
            const float q = sum / static_cast<float>(count);
            if (count == 1 && sources.size() > 1 &&
                rejected({q, first}, x, y, column * S + S / 2, row * S + S / 2))
                continue;
            const glm::vec2 g =
                S > 1 ? slopeInside(first, column * S, row * S) : slope(first, column, row);
            pieces.add(x, y, q, g.x, g.y, 1.0f, present, row * kTile + column);
        }
    }
};

}  // namespace

void Pieces::clear() {
    x.clear();
    y.clear();
    q.clear();
    qx.clear();
    qy.clear();
    share.clear();
    sources.clear();
    pixel.clear();
}

void Pieces::add(float px, float py, float depth, float slopeX, float slopeY, float part,
                 std::uint32_t seenBy, int at) {
    x.push_back(px);
    y.push_back(py);
    q.push_back(depth);
    qx.push_back(slopeX);
    qy.push_back(slopeY);
    share.push_back(part);
    sources.push_back(seenBy);
    pixel.push_back(static_cast<std::uint16_t>(at));
}

void fuseTile(std::span<const LocalSource> sources, const SampleGrid& grid, const DepthAxis& axis,
              int tileX, int tileY, int columns, int rows, Pieces& pieces) {
    float step = 0;
    for (const LocalSource& s : sources) step = std::max(step, s.source->step);
    Fuser fuser{sources, grid, axis, tileX, tileY, pieces, step};
    for (int row = 0; row < rows; ++row) fuser.fuseRow(row, columns);
}

}  // namespace stx::surface
