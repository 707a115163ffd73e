#include "lib/render/surface/source.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "lib/base/parallel.hpp"
#include "lib/render/surface/colour_depth.hpp"
#include "lib/render/surface/depth_noise.hpp"
#include "lib/render/surface/fat_edges.hpp"
#include "lib/render/surface/noisy_views.hpp"
#include "lib/render/surface/sharpen.hpp"
#include "lib/render/surface/silhouette_points.hpp"

namespace stx::surface {
namespace {

// Where no source is named the value was chosen by trial on the project's image sets and meshes.

/// Neighbours whose q differ by less than this share of it are one surface; by more than the
/// second, never; between them, when the slope goes on within this share of the step.
constexpr float kLinkAlways = 0.005f, kLinkNever = 0.03f, kSameSlope = 0.5f;
/// Steps of the depth code that neighbours may differ by all the same: one, and rounding.
constexpr float kLinkSteps = 1.5f;
/// A leaf may leave its plane by this many pixels of parallax at a right angle; of noisy depth by
/// this many times the noise, up to three times as many pixels.
constexpr float kPlanarPixels = 0.08f;
constexpr double kPlanarNoise = 1.5;
constexpr float kPlanarMost = 3.0f;
/// Depth noisier than this share of q counts as this noisy.
constexpr float kMostNoise = 0.01f;

/// Whether neighbours b and c lie on one surface, given the pixels before and after them (0 =
/// none). Small steps always do; larger ones when the surface goes on with the same slope.
bool linked(const DepthAxis& axis, float codeStep, float a, float b, float c, float d) {
    if (!(b > 0.0f && c > 0.0f)) return false;
    const float step = c - b, size = std::abs(step);
    const float scale = axis.relativeScale(std::max(b, c));
    if (size < kLinkAlways * scale + kLinkSteps * codeStep * axis.qPerUnit(std::max(b, c)))
        return true;
    if (size >= kLinkNever * scale) return false;
    const float agree = kSameSlope * size;
    return (a > 0.0f && std::abs(step - (b - a)) < agree) ||
           (d > 0.0f && std::abs(step - (d - c)) < agree);
}

/// A view while it is prepared: its pixels side by side, wherever they are kept.
struct Draft {
    Image<float> q;               ///< see PreparedPage
    Image<std::uint8_t> info;     ///< see PreparedPage
    Image<std::uint8_t> covered;  ///< 1 = full alpha

    [[nodiscard]] bool linkRight(int x, int y) const { return info.at(x, y) & Info::kLinkRight; }
    [[nodiscard]] bool linkDown(int x, int y) const { return info.at(x, y) & Info::kLinkDown; }
    [[nodiscard]] int edgeDistance(int x, int y) const { return info.at(x, y) >> 4; }
    [[nodiscard]] bool pruned(int x, int y) const { return q.at(x, y) < 0.0f; }
};

/// Of orthographic views; 0 for others, whose depth axis does not need it.
double farthestPoint(const PageSet& set, std::size_t view) {
    double farthest = 0.0;
    if (!set.views()[view].camera.orthographic) return farthest;
    for (const PageRectangle& r : set.rectanglesOf(view)) {
        const Image<float>& depth = *set.pages()[static_cast<std::size_t>(r.page)].depth;
        for (int y = r.pageY; y < r.pageY + r.height; ++y)
            for (const float dist : depth.row(y).subspan(static_cast<std::size_t>(r.pageX),
                                                         static_cast<std::size_t>(r.width)))
                if (hasPoint(dist)) farthest = std::max(farthest, static_cast<double>(dist));
    }
    return farthest;
}

/// Calls visit(x, y, texel) for the pixels of a rectangle and `around` more on each side, as far as
/// the view goes, rows on several threads.
template <class Visit>
void forEachPixel(const Source& s, const PageRectangle& r, int around, const Visit& visit) {
    const int x0 = std::max(r.x0 - around, 0), x1 = std::min(r.x1 + around, s.width);
    const int y0 = std::max(r.y0 - around, 0), y1 = std::min(r.y1 + around, s.height);
    parallelForBlocks(y0, y1, 32, [&](std::int64_t from, std::int64_t to) {
        for (int y = static_cast<int>(from); y < to; ++y)
            for (int x = x0; x < x1; ++x) visit(x, y, r.texel(x, y));
    });
}

Draft draftOf(const Source& s) {
    const bool pruned = s.view->pruned;
    Draft d{Image<float>(s.width, s.height, 0.0f), Image<std::uint8_t>(s.width, s.height),
            Image<std::uint8_t>(s.width, s.height, 0)};
    const auto mark = [&](int x, int y, bool covered) {
        d.covered.at(x, y) = covered ? 1 : 0;
        d.q.at(x, y) = covered && pruned ? -1.0f : 0.0f;
    };
    const auto rectangles = s.set->rectanglesOf(s.number);
    if (!s.whole) {
        parallelForBlocks(0, s.height, 32, [&](std::int64_t from, std::int64_t to) {
            for (int y = static_cast<int>(from); y < to; ++y)
                for (int x = 0; x < s.width; ++x) mark(x, y, s.set->objectOutside(s.number, x, y));
        });
        for (const PageRectangle& r : rectangles) {
            const Texture& texture = *s.pages[r.page].texture;
            forEachPixel(s, r, PageSet::kPadding, [&](int x, int y, std::size_t texel) {
                mark(x, y, PageSet::alphaOf(texture, texel) >= 1.0f);
            });
        }
    }
    for (const PageRectangle& r : rectangles) {
        const Texture& texture = *s.pages[r.page].texture;
        const auto* bytes = texture.rgba8();
        const float* depth = s.set->pages()[static_cast<std::size_t>(r.page)].depth->data();
        const DepthAxis axis = s.space.axis;
        forEachPixel(s, r, 0, [&](int x, int y, std::size_t texel) {
            mark(x, y,
                 bytes ? bytes->data()[texel].a == 255 : PageSet::alphaOf(texture, texel) >= 1.0f);
            const float dist = depth[texel];
            if (hasPoint(dist) && dist > 0.0f) d.q.at(x, y) = static_cast<float>(axis.q(dist));
        });
    }
    return d;
}

/// Puts the draft where the pixels of the view are kept.
void keep(Source& s, Draft&& d, std::vector<PreparedPage>& pages) {
    if (s.whole) {
        PreparedPage& page = pages[static_cast<std::size_t>(s.whole - s.pages)];
        page.q = std::move(d.q);
        page.info = std::move(d.info);
        return;
    }
    for (const PageRectangle& r : s.set->rectanglesOf(s.number)) {
        PreparedPage& page = pages[static_cast<std::size_t>(r.page)];
        forEachPixel(s, r, PageSet::kPadding, [&](int x, int y, std::size_t texel) {
            page.q.data()[texel] = d.q.at(x, y);
            page.info.data()[texel] = d.info.at(x, y);
        });
    }
}

void findLinks(const Source& s, Draft& d) {
    const DepthAxis axis = s.space.axis;
    const int width = s.width, height = s.height;
    parallelForBlocks(0, height, 32, [&](std::int64_t from, std::int64_t to) {
        // Beyond the picture lies nothing, which is not the same as background.
        const std::vector<float> nothing(static_cast<std::size_t>(width), 0.0f);
        const auto rowOf = [&](int y) {
            return y >= 0 && y < height ? d.q.row(y).data() : nothing.data();
        };
        for (int y = static_cast<int>(from); y < to; ++y) {
            const float *above = rowOf(y - 1), *here = rowOf(y), *below = rowOf(y + 1),
                        *second = rowOf(y + 2);
            const bool first = y == 0, last = y + 1 == height;
            std::uint8_t* const info = d.info.row(y).data();
            for (int x = 0; x < width; ++x) {
                const float q = here[x];
                if (!(q > 0.0f)) {
                    info[x] = 0;
                    continue;
                }
                const float left = x > 0 ? here[x - 1] : -1.0f;
                const float right = x + 1 < width ? here[x + 1] : -1.0f;
                std::uint8_t bits = 0;
                if (linked(axis, s.step, left, q, right, x + 2 < width ? here[x + 2] : 0.0f))
                    bits |= Info::kLinkRight;
                if (linked(axis, s.step, above[x], q, below[x], second[x])) bits |= Info::kLinkDown;
                if (left == 0.0f || right == 0.0f || (!first && above[x] == 0.0f) ||
                    (!last && below[x] == 0.0f))
                    bits |= Info::kBesideBackground;
                info[x] = bits;
            }
        }
    });
}

/// Fills the block's edge masks and the distances to edges.
void findEdges(Source& s, Draft& d) {
    Image<std::uint8_t> distance(s.width, s.height, kFarFromEdge);
    parallelForBlocks(0, s.blocksY, 1, [&](std::int64_t from, std::int64_t to) {
        for (int y = static_cast<int>(from) * kBlock; y < std::min<int>(to * kBlock, s.height);
             ++y) {
            for (int x = 0; x < s.width; ++x) {
                const float q = d.q.at(x, y);
                if (!(q > 0.0f)) {
                    if (!(q < 0.0f)) distance.at(x, y) = 0;
                    continue;
                }
                const bool all = d.linkRight(x, y) && d.linkDown(x, y) && x > 0 && y > 0 &&
                                 d.linkRight(x - 1, y) && d.linkDown(x, y - 1);
                if (all && (!s.hasAlpha || d.covered.at(x, y))) continue;
                // Where pruning took the neighbour away the surface goes on: that is the border of
                // what has depth, but no edge.
                const bool goesOn = x > 0 && y > 0 && x + 1 < s.width && y + 1 < s.height &&
                                    (d.linkRight(x, y) || d.pruned(x + 1, y)) &&
                                    (d.linkDown(x, y) || d.pruned(x, y + 1)) &&
                                    (d.linkRight(x - 1, y) || d.pruned(x - 1, y)) &&
                                    (d.linkDown(x, y - 1) || d.pruned(x, y - 1));
                if (!(goesOn && (!s.hasAlpha || d.covered.at(x, y)))) distance.at(x, y) = 0;
                if (all) continue;
                auto& block =
                    s.blocks[static_cast<std::size_t>(y / kBlock) * s.blocksX + x / kBlock];
                block.edges[y % kBlock] |= static_cast<std::uint16_t>(1u << (x % kBlock));
                block.anyEdge = true;
            }
        }
    });
    Image<std::uint8_t> rows(s.width, s.height);
    for (int round = 1; round < kFarFromEdge; ++round) {
        parallelForBlocks(0, s.height, 32, [&](std::int64_t from, std::int64_t to) {
            for (int y = static_cast<int>(from); y < to; ++y) {
                // Plain loops, of which compilers make vectors.
                const std::uint8_t* in = distance.row(y).data();
                std::uint8_t* out = rows.row(y).data();
                const int last = s.width - 1;
                out[0] = std::min(in[0], in[std::min(1, last)]);
                for (int x = 1; x < last; ++x) {
                    const std::uint8_t beside = std::min(in[x - 1], in[x + 1]);
                    out[x] = std::min(beside, in[x]);
                }
                if (last > 0) out[last] = std::min(in[last - 1], in[last]);
            }
        });
        parallelForBlocks(0, s.height, 32, [&](std::int64_t from, std::int64_t to) {
            for (int y = static_cast<int>(from); y < to; ++y) {
                const std::uint8_t* above = rows.row(std::max(y - 1, 0)).data();
                const std::uint8_t* here = rows.row(y).data();
                const std::uint8_t* below = rows.row(std::min(y + 1, s.height - 1)).data();
                std::uint8_t* out = distance.row(y).data();
                for (int x = 0; x < s.width; ++x) {
                    const std::uint8_t beside = std::min(above[x], below[x]);
                    const auto next = static_cast<std::uint8_t>(std::min(beside, here[x]) + 1);
                    out[x] = std::min(out[x], next);
                }
            }
        });
    }
    for (std::size_t i = 0; i < distance.count(); ++i)
        d.info.data()[i] |= static_cast<std::uint8_t>(distance.data()[i] << 4);
}

/// The least-squares plane of (size+1)² pixels, when no pixel leaves it by more than `tolerance`.
bool fitPlane(const Source& s, const Draft& d, int x0, int y0, int size, float tolerance,
              Leaf& leaf) {
    const int n = size + 1;
    for (int y = y0; y <= y0 + size; ++y)
        for (int x = x0; x <= x0 + size; ++x)
            if (d.edgeDistance(x, y) < 3) return false;
    const float anchor = d.q.at(x0, y0);
    float sum = 0, sumX = 0, sumY = 0;
    const float half = static_cast<float>(size) * 0.5f;
    for (int y = 0; y < n; ++y) {
        const float* row = &d.q.at(x0, y0 + y);
        for (int x = 0; x < n; ++x) {
            const float above = row[x] - anchor;
            sum += above;
            sumX += above * (static_cast<float>(x) - half);
            sumY += above * (static_cast<float>(y) - half);
        }
    }
    const float spread =
        static_cast<float>(n) * static_cast<float>(n) * static_cast<float>(n * n - 1) / 12.0f;
    leaf.x = static_cast<std::uint16_t>(x0);
    leaf.y = static_cast<std::uint16_t>(y0);
    leaf.size = static_cast<std::uint16_t>(size);
    leaf.qx = sumX / spread;
    leaf.qy = sumY / spread;
    leaf.q0 = anchor + sum / static_cast<float>(n * n) - half * (leaf.qx + leaf.qy);
    const float limit = tolerance * s.space.axis.relativeScale(anchor);
    for (int y = 0; y < n; ++y) {
        const float* row = &d.q.at(x0, y0 + y);
        for (int x = 0; x < n; ++x) {
            const float on =
                leaf.q0 + leaf.qx * static_cast<float>(x) + leaf.qy * static_cast<float>(y);
            if (!(std::abs(on - row[x]) <= limit)) return false;
        }
    }
    return true;
}

void divide(const Source& s, const Draft& d, int x, int y, int size, float tolerance,
            SourceBlock& block, std::vector<Leaf>& leaves) {
    if (x >= s.width - 1 || y >= s.height - 1) return;
    if (size > 1 && x + size < s.width && y + size < s.height) {
        Leaf leaf;
        if (fitPlane(s, d, x, y, size, tolerance, leaf)) {
            leaves.push_back(leaf);
            return;
        }
    }
    if (size > 1) {
        const int h = size / 2;
        divide(s, d, x, y, h, tolerance, block, leaves);
        divide(s, d, x + h, y, h, tolerance, block, leaves);
        divide(s, d, x, y + h, h, tolerance, block, leaves);
        divide(s, d, x + h, y + h, h, tolerance, block, leaves);
        return;
    }
    const int links =
        d.linkRight(x, y) + d.linkDown(x, y) + d.linkRight(x, y + 1) + d.linkDown(x + 1, y);
    if (links < 2) return;
    block.cells[y % kBlock] |= static_cast<std::uint16_t>(1u << (x % kBlock));
    block.anyCell = true;
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
                                         kExtensionReach * scale));
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
            const float limit = kExtensionReach * s.space.axis.relativeScale(q);
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
            float low = std::numeric_limits<float>::max(), high = 0;
            for (int y = y0; y <= std::min(y0 + kBlock, s.height - 1); ++y) {
                for (int x = x0; x <= std::min(x0 + kBlock, s.width - 1); ++x) {
                    const float q = d.q.at(x, y);
                    if (!(q > 0)) continue;
                    low = std::min(low, q);
                    high = std::max(high, q);
                }
            }
            if (!(high > 0)) continue;
            block.qMin = low;
            block.qMax = high;
            block.leafBegin = static_cast<std::uint32_t>(leaves.size());
            divide(s, d, x0, y0, kBlock, s.flat, block, leaves);
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
}

/// See Source::validShare.
double validShareOf(const Draft& d) {
    std::int64_t points = 0, object = 0;
    for (std::size_t i = 0; i < d.q.count(); ++i) {
        points += d.q.data()[i] > 0.0f;
        object += d.q.data()[i] > 0.0f || d.covered.data()[i];
    }
    return object > 0 ? static_cast<double>(points) / static_cast<double>(object) : 1.0;
}

/// The median distance of a view's points, scene units; orthographic: what shares of q are shares
/// of.
float typicalDist(const Source& s, const Draft& d) {
    if (!s.space.axis.inverse) return static_cast<float>(s.space.axis.unit);
    std::vector<float> values;
    for (std::size_t i = 0; i < d.q.count(); i += 7)
        if (d.q.data()[i] > 0.0f) values.push_back(d.q.data()[i]);
    if (values.empty()) return 0.0f;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return 1.0f / *middle;
}

/// The first half of preparing a source: its points. Those of a noisy view may be improved before
/// finishSource().
Draft beginSource(Source& s, NoisyView& noisy) {
    const Camera& camera = s.view->camera;
    s.width = camera.width;
    s.height = camera.height;
    s.space = PixelSpace(camera, farthestPoint(*s.set, s.number));
    if (s.view->depthBits < 32) s.step = static_cast<float>(s.view->depthCode().step());
    s.blocksX = (s.width + kBlock - 1) / kBlock;
    s.blocksY = (s.height + kBlock - 1) / kBlock;
    s.blocks.resize(static_cast<std::size_t>(s.blocksX) * s.blocksY);
    Draft d = draftOf(s);
    const auto& covered = d.covered;
    s.hasAlpha = std::find(covered.data(), covered.data() + covered.count(), 0) !=
                 covered.data() + covered.count();
    s.validShare = validShareOf(d);
    const float noise = depthNoise(d.q, s.space.axis);
    closePinholes(d.q, d.covered, s.space.axis, noise);
    noisy.left = smoothDepth(d.q, s.space.axis, noise, &noisy.surface);
    noisy.space = &s.space;
    return d;
}

void finishSource(Source& s, Draft&& d, float left, std::vector<PreparedPage>& pages) {
    // What smoothing leaves is like the step of a coarser depth code.
    if (left > 0) {
        const float dist = typicalDist(s, d);
        s.step = std::max(s.step, left * dist);
        // Noise along the rays of one view is to the side in another that looks from there.
        const double pixels = s.space.axis.inverse ? s.space.camera.fx / dist : s.space.camera.fx;
        s.beside = static_cast<float>(pixels * left * dist);
    }
    findLinks(s, d);
    findEdges(s, d);
    findLeaves(s, d);
    keep(s, std::move(d), pages);
}

/// See Source::placeOfBlock.
std::vector<std::int32_t> placesOfBlocks(const Source& s) {
    std::vector<std::int32_t> places;
    for (int y = 0; y < s.height; y += kBlock) {
        for (int x = 0; x < s.width; x += kBlock) {
            const int x1 = std::min(x + kBlock + 1, s.width - 1);
            const int y1 = std::min(y + kBlock + 1, s.height - 1);
            const auto near = s.set->near(s.number, x, y);
            std::int32_t place = Source::kSeveralPlaces;
            if (near.empty()) {
                int pruned = 0;
                for (int j = y; j <= y1; ++j)
                    for (int i = x; i <= x1; ++i) pruned += s.set->objectOutside(s.number, i, j);
                if (pruned == 0) place = Source::kNothingThere;
                if (pruned == (x1 - x + 1) * (y1 - y + 1)) place = Source::kAllPruned;
            } else if (s.set->reads(s.set->rectangles()[near[0]], std::max(x - 1, 0),
                                    std::max(y - 1, 0), x1, y1)) {
                place = static_cast<std::int32_t>(near[0]);
            }
            places.push_back(place);
        }
    }
    return places;
}

/// Views in rectangles, one after the other: a draft takes the memory of a whole view. False when
/// their depth is noisy or reaches over their edges, so that prepareTogether() makes more of them.
bool prepareAlone(std::vector<Source>& sources, std::vector<PreparedPage>& pages) {
    std::vector<float> shares;
    for (Source& s : sources) {
        NoisyView noisy;
        Draft d = beginSource(s, noisy);
        if (noisy.left > 0) return false;
        const Texture texture = s.set->textureOfView(s.number);
        const auto more = sharesAtEdges({&s.space, &texture, &d.q, s.step});
        shares.insert(shares.end(), more.begin(), more.end());
        finishSource(s, std::move(d), 0.0f, pages);
    }
    return !edgesAreFat(colourAtEdges(std::move(shares)));
}

/// Views side by side: they wait for each other where their depth is noisy or reaches over their
/// edges. Those in rectangles take the memory of whole views meanwhile. Whether neither was so.
bool prepareTogether(std::vector<Source>& sources, std::vector<PreparedPage>& pages) {
    std::vector<Draft> drafts(sources.size());
    std::vector<NoisyView> views(sources.size());
    std::vector<Texture> copies(sources.size());
    std::vector<const Texture*> textures(sources.size());
    const auto count = static_cast<std::int64_t>(sources.size());
    parallelFor(0, count, [&](std::int64_t i) {
        const auto k = static_cast<std::size_t>(i);
        const Source& s = sources[k];
        drafts[k] = beginSource(sources[k], views[k]);
        if (!s.whole) copies[k] = s.set->textureOfView(k);
        textures[k] = s.whole ? s.whole->texture : &copies[k];
    });
    std::vector<EdgeView> edges;
    for (std::size_t k = 0; k < sources.size(); ++k)
        edges.push_back({&sources[k].space, textures[k], &drafts[k].q, sources[k].step});
    const bool fat = thinFatEdges(edges) > 0;
    std::vector<std::size_t> noisyOnes;
    std::vector<NoisyView> noisy;
    for (std::size_t k = 0; k < sources.size(); ++k) {
        if (!(views[k].left > 0)) continue;
        noisyOnes.push_back(k);
        noisy.push_back(std::move(views[k]));
        noisy.back().q = &drafts[k].q;
        noisy.back().texture = textures[k];
    }
    keepInSilhouettes(noisy);
    agreeOnDepth(noisy);
    matchColours(noisy);
    keepInSilhouettes(noisy);
    std::vector<float> left(sources.size(), 0.0f);
    for (std::size_t n = 0; n < noisy.size(); ++n) left[noisyOnes[n]] = noisy[n].left;
    parallelFor(0, count, [&](std::int64_t i) {
        const auto k = static_cast<std::size_t>(i);
        finishSource(sources[k], std::move(drafts[k]), left[k], pages);
    });
    return !fat && noisy.empty();
}

}  // namespace

SurfaceScene::SurfaceScene(const PageSet& pageSet, bool sharpens) : set(pageSet) {
    prepare();
    // One view cannot tell whether its depth is exact; where it is not, sharper is worse.
    if (!sharpens || sources.size() < 2) return;
    sharpened = sharpenedTextures(*this);
    for (std::size_t i = 0; i < pages.size(); ++i) pages[i].texture = sharpened[i].get();
}

void SurfaceScene::begin() {
    sources.clear();
    sources.resize(set.views().size());
    for (std::size_t i = 0; i < sources.size(); ++i) {
        Source& s = sources[i];
        s.view = &set.views()[i];
        s.number = i;
        s.set = &set;
        s.pages = pages.data();
        if (s.view->whole) s.whole = pages.data() + set.rectanglesOf(i)[0].page;
    }
}

void SurfaceScene::prepare() {
    pages.resize(set.pages().size());
    for (std::size_t i = 0; i < pages.size(); ++i) pages[i].texture = set.pages()[i].texture;
    begin();
    if (std::all_of(sources.begin(), sources.end(), [](const Source& s) { return s.whole; })) {
        exactDepth = prepareTogether(sources, pages);
        return;
    }
    for (std::size_t i = 0; i < pages.size(); ++i) {
        const Page& page = set.pages()[i];
        pages[i].q = Image<float>(page.width(), page.height(), 0.0f);
        pages[i].info = Image<std::uint8_t>(page.width(), page.height(), 0);
    }
    if (!prepareAlone(sources, pages)) {
        begin();
        exactDepth = prepareTogether(sources, pages);
    }
    for (Source& s : sources)
        if (!s.whole) s.placeOfBlock = placesOfBlocks(s);
}

}  // namespace stx::surface
