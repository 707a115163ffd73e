#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "lib/base/parallel.hpp"
#include "lib/render/surface/prepare/draft.hpp"

namespace stx::surface {
namespace {

// Chosen by trial on the project's image sets and meshes.

/// A leaf may leave its plane by this many pixels of parallax at a right angle; of noisy depth by
/// this many times the noise, up to three times as many pixels.
constexpr float kPlanarPixels = 0.08f;
constexpr double kPlanarNoise = 1.5;
constexpr float kPlanarMost = 3.0f;
/// Depth noisier than this share of q counts as this noisy.
constexpr float kMostNoise = 0.01f;

/// Leaves keep so far from edges, pixels.
constexpr int kInside = 3;
/// What rounding may add to second differences and planes, of the largest q.
constexpr float kRoundingOfPlanes = 4e-6f;

/// What divide() works on.
struct Division {
    const Source& s;
    const Draft& d;
    SourceBlock& block;
    std::vector<Leaf>& leaves;
    int x0, y0;  ///< of the block
    /// By row of the block and the one below it: which of its pixels and the one beside it are
    /// kInside.
    std::array<std::uint32_t, kBlock + 1> inside{};
};

void findInside(Division& v) {
    const int rows = std::min<int>(kBlock + 1, v.s.height - v.y0);
    const int columns = std::min<int>(kBlock + 1, v.s.width - v.x0);
    for (int y = 0; y < rows; ++y) {
        const std::uint8_t* info = &v.d.info.at(v.x0, v.y0 + y);
        std::uint32_t bits = 0;
        for (int x = 0; x < columns; ++x)
            bits |= static_cast<std::uint32_t>(info[x] >= kInside << 4) << x;
        v.inside[static_cast<std::size_t>(y)] = bits;
    }
}

/// False where no plane has all pixels within `limit`, which most squares of this kind show in a
/// few of them: on a plane, the second difference of three is 0. `q`: the first of (kSize+1)²
/// pixels.
template <int kSize>
bool mayBePlane(const float* q, std::ptrdiff_t stride, float limit, float largest) {
    const float most = 4.01f * limit + kRoundingOfPlanes * largest;
    const auto bends = [&](std::ptrdiff_t first, std::ptrdiff_t step) {
        const float difference =
            (q[first] - q[first + step]) - (q[first + step] - q[first + 2 * step]);
        return !(std::abs(difference) <= most);
    };
    constexpr std::ptrdiff_t kHalf = kSize / 2;
    for (std::ptrdiff_t k = 0; k <= kSize; k += kHalf)
        if (bends(k * stride, kHalf) || bends(k, kHalf * stride)) return false;
    return !bends(0, kHalf * (stride + 1)) && !bends(kSize, kHalf * (stride - 1));
}

/// The least-squares plane of (kSize+1)² pixels, when no pixel leaves it by more than `tolerance`.
template <int kSize>
bool fitPlane(const Division& v, int x0, int y0, float tolerance, Leaf& leaf) {
    constexpr int n = kSize + 1;
    std::uint32_t inside = ~0u;
    for (int y = 0; y < n; ++y) inside &= v.inside[static_cast<std::size_t>(y0 - v.y0 + y)];
    constexpr std::uint32_t kAll = (1u << n) - 1;
    if ((inside >> (x0 - v.x0) & kAll) != kAll) return false;
    const std::ptrdiff_t stride = v.s.width;
    const float* q = &v.d.q.at(x0, y0);
    const float anchor = q[0];
    // What was pruned has no surface, however even its mark is.
    if (!(anchor > 0.0f)) return false;
    const float limit = tolerance * v.s.space.axis.relativeScale(anchor);
    if (!mayBePlane<kSize>(q, stride, limit, v.block.qMax)) return false;
    float sum = 0, sumX = 0, sumY = 0;
    constexpr float half = static_cast<float>(kSize) * 0.5f;
    for (int y = 0; y < n; ++y) {
        const float* row = q + y * stride;
        for (int x = 0; x < n; ++x) {
            const float above = row[x] - anchor;
            sum += above;
            sumX += above * (static_cast<float>(x) - half);
            sumY += above * (static_cast<float>(y) - half);
        }
    }
    constexpr float spread =
        static_cast<float>(n) * static_cast<float>(n) * static_cast<float>(n * n - 1) / 12.0f;
    leaf.x = static_cast<std::uint16_t>(x0);
    leaf.y = static_cast<std::uint16_t>(y0);
    leaf.size = static_cast<std::uint16_t>(kSize);
    leaf.qx = sumX / spread;
    leaf.qy = sumY / spread;
    leaf.q0 = anchor + sum / static_cast<float>(n * n) - half * (leaf.qx + leaf.qy);
    for (int y = 0; y < n; ++y) {
        const float* row = q + y * stride;
        // Without a way out in between: compilers make vectors of it.
        int beyond = 0;
        for (int x = 0; x < n; ++x) {
            const float on =
                leaf.q0 + leaf.qx * static_cast<float>(x) + leaf.qy * static_cast<float>(y);
            beyond |= static_cast<int>(!(std::abs(on - row[x]) <= limit));
        }
        if (beyond != 0) return false;
    }
    return true;
}

template <int kSize>
void divide(Division& v, int x, int y, float tolerance) {
    const Source& s = v.s;
    if (x >= s.width - 1 || y >= s.height - 1) return;
    if constexpr (kSize > 1) {
        if (x + kSize < s.width && y + kSize < s.height) {
            Leaf leaf;
            if (fitPlane<kSize>(v, x, y, tolerance, leaf)) {
                v.leaves.push_back(leaf);
                return;
            }
        }
        constexpr int h = kSize / 2;
        divide<h>(v, x, y, tolerance);
        divide<h>(v, x + h, y, tolerance);
        divide<h>(v, x, y + h, tolerance);
        divide<h>(v, x + h, y + h, tolerance);
    } else {
        const Draft& d = v.d;
        const int links =
            d.linkRight(x, y) + d.linkDown(x, y) + d.linkRight(x, y + 1) + d.linkDown(x + 1, y);
        if (links < 2) return;
        v.block.cells[y % kBlock] |= static_cast<std::uint16_t>(1u << (x % kBlock));
        v.block.anyCell = true;
    }
}

/// The range of the points of a block and one pixel around it; 0, 0 without one.
void findRange(const Source& s, const Draft& d, int x0, int y0, SourceBlock& block) {
    constexpr float kMost = std::numeric_limits<float>::max();
    // By columns: compilers make vectors of it.
    constexpr int kColumns = kBlock + 1;
    float low[kColumns], high[kColumns] = {};
    std::fill_n(low, kColumns, kMost);
    const int y1 = std::min(y0 + kBlock, s.height - 1);
    const int columns = std::min(kColumns, s.width - x0);
    const auto widen = [&](const float* q, int count) {
        for (int i = 0; i < count; ++i) {
            const float point = q[i] > 0.0f ? q[i] : kMost;
            low[i] = point < low[i] ? point : low[i];
            high[i] = q[i] > high[i] ? q[i] : high[i];
        }
    };
    for (int y = y0; y <= y1; ++y) {
        const float* q = &d.q.at(x0, y);
        if (columns == kColumns)
            widen(q, kColumns);
        else
            widen(q, columns);
    }
    const float most = *std::max_element(high, high + kColumns);
    if (!(most > 0)) return;
    block.qMin = *std::min_element(low, low + kColumns);
    block.qMax = most;
}

/// How far the code of the depth makes planes uneven: the median second difference, relative.
float unevenness(const Source& s, const Draft& d) {
    std::vector<float> values;
    const int step = std::max(1, s.height / 64);
    for (int y = step / 2; y < s.height; y += step) {
        for (int x = 1; x + 1 < s.width; x += 3) {
            if (d.edgeDistance(x, y) < 3) continue;
            const float q = d.q.at(x, y);
            if (!(q > 0 && d.q.at(x - 1, y) > 0 && d.q.at(x + 1, y) > 0)) continue;
            values.push_back(std::abs(d.q.at(x - 1, y) - 2 * q + d.q.at(x + 1, y)) /
                             s.space.axis.relativeScale(q));
        }
    }
    if (values.empty()) return 0.0f;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

/// See SourceBlock::reach: leaves are near their pixels, extensions go on with a pixel's gradient.
float reachOf(const Source& s, const Draft& d, const SourceBlock& block, int x0, int y0) {
    const float scale = s.space.axis.relativeScale(block.qMax);
    float reach = block.leafEnd > block.leafBegin ? s.flat * scale : 0.0f;
    for (int j = 0; block.anyEdge && j < kBlock; ++j) {
        for (std::uint32_t left = block.edges[j]; left; left &= left - 1) {
            const int x = x0 + std::countr_zero(left), y = y0 + j;
            const glm::vec2 g =
                gradientFrom(&d.q.at(x, y), &d.info.at(x, y), 1, s.width, x > 0, y > 0);
            reach =
                std::max(reach, std::min(kHalfBesideBackground * (std::abs(g.x) + std::abs(g.y)),
                                         kExtensionReach * s.space.axis.stepScale(block.qMax)));
        }
    }
    return reach;
}

/// Fills SourceBlock::leastSlope and mostSlope; `leaves`: the block's.
void findSlopes(const Source& s, const Draft& d, std::span<const Leaf> leaves, SourceBlock& block,
                int x0, int y0) {
    glm::vec2 least(std::numeric_limits<float>::max()), most(-least);
    const auto add = [&](glm::vec2 slope) {
        least = glm::min(least, slope);
        most = glm::max(most, slope);
    };
    for (const Leaf& leaf : leaves) add({leaf.qx, leaf.qy});
    for (int j = 0; block.anyCell && j < kBlock; ++j) {
        for (std::uint32_t left = block.cells[j]; left; left &= left - 1) {
            // However it is cut in two, its triangles have the slopes of two of its sides.
            const float* q = &d.q.at(x0 + std::countr_zero(left), y0 + j);
            add({q[1] - q[0], q[s.width] - q[0]});
            add({q[s.width + 1] - q[s.width], q[s.width + 1] - q[1]});
        }
    }
    for (int j = 0; block.anyEdge && j < kBlock; ++j) {
        for (std::uint32_t left = block.edges[j]; left; left &= left - 1) {
            // Its corners leave the pixel's q by so much at most.
            const int x = x0 + std::countr_zero(left), y = y0 + j;
            const float q = d.q.at(x, y);
            const glm::vec2 g =
                gradientFrom(&d.q.at(x, y), &d.info.at(x, y), 1, s.width, x > 0, y > 0);
            const float limit = kExtensionReach * s.space.axis.stepScale(q);
            for (const float half : {kHalfInside, kHalfBesideBackground}) {
                const float sum = std::clamp(half * (g.x + g.y), -limit, limit);
                const float difference = std::clamp(half * (g.x - g.y), -limit, limit);
                add(glm::vec2(sum + difference, sum - difference) / (2 * half));
            }
        }
    }
    block.leastSlope = least;
    block.mostSlope = most;
}

/// Fills Source::planned and Source::regions.
void listPlanned(Source& s) {
    s.planned.clear();
    s.regions.clear();
    for (int by = 0; by < s.blocksY; by += kRegion) {
        for (int bx = 0; bx < s.blocksX; bx += kRegion) {
            Source::PlannedRegion region;
            region.x = bx * kBlock;
            region.y = by * kBlock;
            region.begin = static_cast<std::uint32_t>(s.planned.size());
            const int endX = std::min(bx + kRegion, s.blocksX);
            for (int y = by; y < std::min(by + kRegion, s.blocksY); ++y) {
                for (int x = bx; x < endX; ++x) {
                    const auto number = static_cast<std::uint32_t>(y * s.blocksX + x);
                    const BlockRange& block = s.blocks[number];
                    if (!(block.qMax > 0)) continue;
                    const bool first = s.planned.size() == region.begin;
                    region.qMin = first ? block.qMin : std::min(region.qMin, block.qMin);
                    region.qMax = std::max(region.qMax, block.qMax);
                    region.reach = std::max(region.reach, block.reach);
                    region.middle += glm::vec3((static_cast<float>(x) + 0.5f) * kBlock,
                                               (static_cast<float>(y) + 0.5f) * kBlock,
                                               0.5f * (block.qMin + block.qMax));
                    s.planned.push_back(number);
                }
            }
            region.end = static_cast<std::uint32_t>(s.planned.size());
            if (region.end == region.begin) continue;
            region.middle /= static_cast<float>(region.end - region.begin);
            s.regions.push_back(region);
        }
    }
}

}  // namespace

void findLeaves(Source& s, const Draft& d) {
    s.noise = std::min(unevenness(s, d), kMostNoise);
    const double focal = std::max(s.space.camera.fx, s.space.camera.fy);
    const double perPixel = 1.0 / (focal * (s.space.axis.inverse ? 1.0 : s.space.axis.unit));
    s.flat = static_cast<float>(std::clamp<double>(kPlanarNoise * s.noise, kPlanarPixels * perPixel,
                                                   kPlanarMost * kPlanarPixels * perPixel));
    std::vector<std::vector<Leaf>> rows(static_cast<std::size_t>(s.blocksY));
    parallelFor(0, s.blocksY, [&](std::int64_t by) {
        auto& leaves = rows[static_cast<std::size_t>(by)];
        for (int bx = 0; bx < s.blocksX; ++bx) {
            auto& block = s.blocks[static_cast<std::size_t>(by) * s.blocksX + bx];
            const int x0 = bx * kBlock, y0 = static_cast<int>(by) * kBlock;
            findRange(s, d, x0, y0, block);
            if (!(block.qMax > 0)) continue;
            block.leafBegin = static_cast<std::uint32_t>(leaves.size());
            Division division{s, d, block, leaves, x0, y0};
            findInside(division);
            divide<kBlock>(division, x0, y0, s.flat);
            block.leafEnd = static_cast<std::uint32_t>(leaves.size());
            block.reach = reachOf(s, d, block, x0, y0);
            findSlopes(s, d, {leaves.data() + block.leafBegin, leaves.data() + block.leafEnd},
                       block, x0, y0);
        }
    });
    for (int by = 0; by < s.blocksY; ++by) {
        const auto base = static_cast<std::uint32_t>(s.leaves.size());
        const auto& leaves = rows[static_cast<std::size_t>(by)];
        s.leaves.insert(s.leaves.end(), leaves.begin(), leaves.end());
        for (int bx = 0; bx < s.blocksX; ++bx) {
            auto& block = s.blocks[static_cast<std::size_t>(by) * s.blocksX + bx];
            block.leafBegin += base;
            block.leafEnd += base;
        }
    }
    listPlanned(s);
}

}  // namespace stx::surface
