#include "lib/background/mixed_pixels.hpp"

#include <algorithm>
#include <vector>

#include "lib/base/parallel.hpp"
#include "lib/geometry/depth_code.hpp"

namespace stx::temporal {
namespace {

/// Depths of neighbours differ by this share or more at an edge, and by this many tolerances.
constexpr float kEdgeShare = 0.03f, kEdgeTolerances = 2;
/// An edge is marked on the pixels on both of its sides, and widened by this.
constexpr int kReach = 1;
/// Rows that are worked on together.
constexpr std::int64_t kRows = 8;

/// Sets 1 where two rows of inverse distances may have an edge between them. Without branches, so
/// that the compiler makes vectors of it.
void markEdges(const float* a, const float* b, int count, std::uint8_t* edge) {
    for (int x = 0; x < count; ++x) {
        const float near = std::max(a[x], b[x]), far = std::min(a[x], b[x]);
        edge[x] = near - far > kEdgeShare * near;
    }
}

}  // namespace

Image<float> inverseOf(const Image<float>& depth) {
    Image<float> inverse(depth.width(), depth.height());
    parallelForBlocks(0, depth.height(), 32, [&](std::int64_t from, std::int64_t to) {
        const std::size_t w = static_cast<std::size_t>(depth.width());
        const float* in = depth.data() + static_cast<std::size_t>(from) * w;
        float* out = inverse.data() + static_cast<std::size_t>(from) * w;
        const std::size_t count = static_cast<std::size_t>(to - from) * w;
        // Of kNoDepth, which is infinite, it is 0 by itself.
        for (std::size_t i = 0; i < count; ++i) out[i] = in[i] > 0 ? 1 / in[i] : 0.0f;
    });
    return inverse;
}

Image<std::uint8_t> mixedPixels(const Image<float>& inverse, const DepthNoise& noise, float step,
                                int from, int to) {
    const int w = inverse.width(), h = inverse.height();
    const int top = std::max(from - kReach, 0), bottom = std::min(to + kReach, h);
    // Where the noise of the sensor is larger than that share, it makes no edges.
    const auto stands = [&](float a, float b) {
        const float near = std::max(a, b), far = std::min(a, b);
        return !(far > 0) || near - far > kEdgeTolerances * near * noise.tolerance(1 / far, step);
    };
    Image<std::uint8_t> across(w, bottom - top, std::uint8_t{0});
    parallelForBlocks(top, bottom, kRows, [&](std::int64_t begin, std::int64_t end) {
        const auto count = static_cast<std::size_t>(w);
        std::vector<std::uint8_t> edge(count), found(count);
        for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
            std::fill(edge.begin(), edge.end(), std::uint8_t{0});
            const float* row = inverse.row(y).data();
            const auto take = [&](const float* a, const float* b, int pairs, int second) {
                markEdges(a, b, pairs, found.data());
                for (int x = 0; x < pairs; ++x) {
                    const auto i = static_cast<std::size_t>(x);
                    if (!found[i] || !stands(a[x], b[x])) continue;
                    edge[i] = edge[i + static_cast<std::size_t>(second)] = 1;
                }
            };
            take(row, row + 1, w - 1, 1);
            if (y > 0) take(row, inverse.row(y - 1).data(), w, 0);
            if (y + 1 < h) take(row, inverse.row(y + 1).data(), w, 0);
            std::uint8_t* out = across.row(y - top).data();
            for (int x = 0; x < w; ++x)
                out[x] =
                    edge[x] | edge[std::max(x - kReach, 0)] | edge[std::min(x + kReach, w - 1)];
        }
    });
    Image<std::uint8_t> mixed(w, to - from, std::uint8_t{0});
    parallelFor(from, to, kRows, [&](int y) {
        std::uint8_t* out = mixed.row(y - from).data();
        for (int k = std::max(y - kReach, top); k <= std::min(y + kReach, bottom - 1); ++k) {
            const std::uint8_t* in = across.row(k - top).data();
            for (int x = 0; x < w; ++x) out[x] |= in[x];
        }
    });
    return mixed;
}

}  // namespace stx::temporal
