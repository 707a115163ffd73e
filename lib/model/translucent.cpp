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
    // Most pictures have no such pixel at all: this is a loop that compilers make vectors of.
    const auto mayBeTranslucent = [&](int y) {
        const auto* bytes = texture.rgba8();
        if (!bytes) return true;
        int any = 0;
        for (const glm::u8vec4 p : bytes->row(y))
            any |= static_cast<int>(static_cast<std::uint8_t>(p.a - 1) < 254);
        return any != 0;
    };
    parallelFor(kInside, h - kInside, [&](int y) {
        if (!mayBeTranslucent(y)) return;
        for (int x = kInside; x + kInside < w; ++x) {
            if (!isTranslucent(x, y)) continue;
            bool all = true;
            for (int dy = -kInside; all && dy <= kInside; ++dy) {
                for (int dx = -kInside; all && dx <= kInside; ++dx)
                    all = isTranslucent(x + dx, y + dy);
            }
            inside.at(x, y) = all ? 1 : 0;
        }
    });
    return inside;
}

bool hasTranslucentInside(const Texture& texture, const Image<float>& depth) {
    const auto inside = translucentInside(texture, depth);
    return std::ranges::find(inside.pixels(), std::uint8_t{1}) != inside.pixels().end();
}

}  // namespace stx
