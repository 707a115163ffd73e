#include "lib/render/scene/glass_pages.hpp"

#include <algorithm>
#include <cmath>

#include "lib/base/parallel.hpp"
#include "lib/model/translucent.hpp"

namespace stx {
namespace {

/// How far glass goes on around points inside of it, pixels: over its border, as
/// translucentSurfaces() has it.
constexpr int kBorder = 4;

/// The largest alpha of the points inside of glass within kBorder of a pixel, along both axes.
float alphaInside(const Texture& texture, const Image<std::uint8_t>& inside, int x, int y) {
    float most = 0;
    for (int v = y - kBorder; v <= y + kBorder; ++v)
        for (int u = x - kBorder; u <= x + kBorder; ++u)
            if (inside.contains(u, v) && inside.at(u, v)) most = std::max(most, texture.at(u, v).a);
    return most;
}

}  // namespace

Image<std::uint8_t> glassCoverage(const Texture& texture, const Image<float>& depth) {
    const Image<std::uint8_t> inside = translucentInside(texture, depth);
    if (std::ranges::find(inside.pixels(), std::uint8_t{1}) == inside.pixels().end()) return {};
    Image<std::uint8_t> out(depth.width(), depth.height(), std::uint8_t{0});
    parallelFor(0, depth.height(), [&](int y) {
        texture.forEachInPart(y, [&](int x) {
            if (inside.at(x, y)) {
                out.at(x, y) = 255;
            } else if (const float most = alphaInside(texture, inside, x, y); most > 0) {
                const float share = std::min(texture.at(x, y).a / most, 1.0f);
                out.at(x, y) = static_cast<std::uint8_t>(std::max(1L, std::lround(255 * share)));
            }
        });
    });
    return out;
}

GlassPages::GlassPages(const PageSet& set) : coverage_(set.pages().size()) {
    for (std::size_t i = 0; i < coverage_.size(); ++i) {
        const Page& page = set.pages()[i];
        if (page.depth->empty()) continue;
        set.settle();
        coverage_[i] = glassCoverage(*page.texture, *page.depth);
        if (coverage_[i].empty()) continue;
        none_ = false;
        coverage_[i].moveTo(set.spool());
    }
}

}  // namespace stx
