#include "lib/model/translucent.hpp"

#include <algorithm>

#include "lib/base/parallel.hpp"
#include "lib/geometry/depth_code.hpp"

namespace stx {
namespace {

/// Pixels around a translucent point that must be such, too, for it to be inside of glass; what is
/// partly covered along an outline is narrower.
constexpr int kInside = 2;
/// How far full alpha reaches from points inside of glass, pixels: over its border.
constexpr int kReach = 4;

/// 1 for all pixels within kReach of those of 1, along both axes.
Image<std::uint8_t> widened(const Image<std::uint8_t>& from) {
    const int w = from.width(), h = from.height();
    Image<std::uint8_t> across(w, h, std::uint8_t{0}), out(w, h, std::uint8_t{0});
    const auto spread = [&](const Image<std::uint8_t>& in, Image<std::uint8_t>& to, int stepX,
                            int stepY) {
        parallelFor(0, h, [&](int y) {
            for (int x = 0; x < w; ++x) {
                std::uint8_t any = 0;
                for (int k = -kReach; k <= kReach; ++k) {
                    const int px = x + k * stepX, py = y + k * stepY;
                    if (px >= 0 && py >= 0 && px < w && py < h) any |= in.at(px, py);
                }
                to.at(x, y) = any;
            }
        });
    };
    spread(from, across, 1, 0);
    spread(across, out, 0, 1);
    return out;
}

bool anyOf(const Image<std::uint8_t>& inside) {
    return std::ranges::find(inside.pixels(), std::uint8_t{1}) != inside.pixels().end();
}

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
    return anyOf(translucentInside(texture, depth));
}

Image<std::uint8_t> translucentSurfaces(const Texture& texture, const Image<float>& depth) {
    const auto inside = translucentInside(texture, depth);
    if (!anyOf(inside)) return {};
    auto out = widened(inside);
    for (std::size_t i = 0; i < out.count(); ++i)
        if (!hasPoint(depth.data()[i])) out.data()[i] = 0;
    return out;
}

}  // namespace stx
