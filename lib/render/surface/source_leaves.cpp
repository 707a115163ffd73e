#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "lib/base/parallel.hpp"
#include "lib/render/surface/draft.hpp"

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

}  // namespace stx::surface
