#include "lib/render/surface/prepare/sharpen.hpp"

#include <algorithm>
#include <type_traits>

#include "lib/base/parallel.hpp"
#include "lib/render/surface/prepare/source_rows.hpp"

namespace stx::surface {
namespace {

/// What a pixel gets of four times its difference to the mean of its neighbours, in 1/256. By
/// trial: more makes a plain texture sharper still, and `spheres-miv` worse.
constexpr int kShare256 = 11;
/// A light may be a thousand times as bright as the pixel beside it, which changes by no more than
/// this share of itself.
constexpr float kMostOfLight = 0.5f;
/// Pixels nearer to an edge keep their colours.
constexpr int kFromEdge = 2;

/// Texels of a pixel and its neighbours.
struct Cross {
    std::size_t middle, left, right, above, below;
};

glm::u8vec4 sharpened(const glm::u8vec4* c, const Cross& t) {
    glm::u8vec4 out = c[t.middle];
    for (int k = 0; k < 3; ++k) {
        const int beside = c[t.left][k] + c[t.right][k] + c[t.above][k] + c[t.below][k];
        const int more = ((4 * out[k] - beside) * kShare256 + 128) >> 8;
        out[k] = static_cast<std::uint8_t>(std::clamp(out[k] + more, 0, 255));
    }
    return out;
}

glm::vec4 sharpened(const glm::vec4* c, const Cross& t) {
    const glm::vec3 here(c[t.middle]);
    const glm::vec3 beside(c[t.left] + c[t.right] + c[t.above] + c[t.below]);
    const glm::vec3 more = (4.0f * here - beside) * (static_cast<float>(kShare256) / 256.0f);
    const glm::vec3 most = kMostOfLight * glm::abs(here);
    return {here + glm::clamp(more, -most, most), c[t.middle].a};
}

/// Whether the neighbours lie on the surface of the pixel, and no edge is near.
bool onOneSurface(const std::uint8_t* info, const Cross& t) {
    constexpr std::uint8_t kBoth = Info::kLinkRight | Info::kLinkDown;
    return info[t.middle] >> 4 >= kFromEdge && (info[t.middle] & kBoth) == kBoth &&
           (info[t.left] & Info::kLinkRight) != 0 && (info[t.above] & Info::kLinkDown) != 0;
}

/// The last texels of a rectangle's padding keep their colours: what is beside them is not known.
template <class Pixel>
void sharpen(const Source& s, const PageRectangle& r, const Pixel* from, Pixel* to) {
    const std::uint8_t* info = s.pages[r.page].info.data();
    const int around = s.whole ? 0 : PageSet::kPadding;
    const int x0 = std::max(r.x0 - around, 0) + 1, x1 = std::min(r.x1 + around, s.width) - 1;
    const int y0 = std::max(r.y0 - around, 0) + 1, y1 = std::min(r.y1 + around, s.height) - 1;
    if (x0 >= x1) return;
    parallelForBlocks(y0, y1, 32, [&](std::int64_t first, std::int64_t end) {
        for (int y = static_cast<int>(first); y < end; ++y) {
            int x = x0;
            if constexpr (std::is_same_v<Pixel, glm::u8vec4>) {
                const std::size_t at = r.texel(x0, y);
                if (r.stepX == 1)
                    x += static_cast<int>(sharpenRow(from + at, info + at, r.stepY,
                                                     static_cast<std::size_t>(x1 - x0), kFromEdge,
                                                     kShare256, to + at));
            }
            for (; x < x1; ++x) {
                const Cross t{r.texel(x, y), r.texel(x - 1, y), r.texel(x + 1, y),
                              r.texel(x, y - 1), r.texel(x, y + 1)};
                if (onOneSurface(info, t)) to[t.middle] = sharpened(from, t);
            }
        }
    });
}

}  // namespace

std::vector<std::shared_ptr<const Texture>> sharpenedTextures(const SurfaceScene& scene) {
    std::vector<std::shared_ptr<const Texture>> textures;
    for (std::size_t p = 0; p < scene.pages.size(); ++p) {
        const Texture& from = *scene.pages[p].texture;
        Texture to = from;
        for (const PageRectangle& r : scene.set.rectangles()) {
            if (static_cast<std::size_t>(r.page) != p) continue;
            const Source& s = scene.sources[static_cast<std::size_t>(r.view)];
            if (s.view->unread) continue;
            if (const auto* bytes = from.rgba8())
                sharpen(s, r, bytes->data(), to.rgba8()->data());
            else
                sharpen(s, r, from.rgbaFloat()->data(), to.rgbaFloat()->data());
        }
        to.moveTo(scene.set.spool());
        textures.push_back(std::make_shared<const Texture>(std::move(to)));
    }
    return textures;
}

}  // namespace stx::surface
