#include "lib/model/translucent.hpp"

#include <algorithm>

#include "lib/base/parallel.hpp"
#include "lib/geometry/depth_code.hpp"

namespace stx {
namespace {

/// Pixels around a translucent point that must be such, too, for it to be inside of glass; what is
/// partly covered along an outline is narrower.
constexpr int kInside = 2;

}  // namespace

Image<std::uint8_t> translucentInside(const Texture& texture, const Image<float>& depth) {
    const int w = depth.width(), h = depth.height();
    Image<std::uint8_t> inside(w, h, std::uint8_t{0});
    const auto isTranslucent = [&](int x, int y) {
        const std::size_t texel = static_cast<std::size_t>(y) * w + x;
        const float alpha = texture.alpha(texel);
        return alpha > 0.0f && alpha < 1.0f && hasPoint(depth.data()[texel]);
    };
    parallelFor(kInside, h - kInside, [&](int y) {
        // Most pictures have few such pixels, or none.
        texture.forEachInPart(y, [&](int x) {
            bool all = x >= kInside && x + kInside < w;
            for (int dy = -kInside; all && dy <= kInside; ++dy) {
                for (int dx = -kInside; all && dx <= kInside; ++dx)
                    all = isTranslucent(x + dx, y + dy);
            }
            inside.at(x, y) = all ? 1 : 0;
        });
    });
    return inside;
}

bool hasTranslucentInside(const Texture& texture, const Image<float>& depth) {
    const auto inside = translucentInside(texture, depth);
    return std::ranges::find(inside.pixels(), std::uint8_t{1}) != inside.pixels().end();
}

}  // namespace stx
