#include "lib/refine/silhouettes.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "lib/base/parallel.hpp"

namespace stx {
namespace {

// Chosen by trial on the sets of tests/bench/pictures.md with noise added.

/// Places are looked at up to so many standard deviations away, so many on each side.
constexpr float kFarthestDoubts = 6.0f;
constexpr int kPlaces = 16;

/// A view that may see background at a point.
struct Witness {
    const Texture* texture;
    int width, height;
    Warp warp;  ///< from the pixels of the view that is looked at
    SilhouetteAlpha level;

    [[nodiscard]] float alpha(int x, int y) const {
        x = std::clamp(x, 0, width - 1);
        y = std::clamp(y, 0, height - 1);
        return texture->alpha(static_cast<std::size_t>(y) * width + x);
    }

    /// As isBackground() of shaders/shared/surface_votes.glsl.
    [[nodiscard]] bool seesBackground(float x, float y, float q) const {
        const glm::vec4 h = warp.homogeneous(x, y, q);
        if (!(h.w > 0.0f)) return false;
        const float u = h.x / h.w, v = h.y / h.w;
        if (!(u >= 0.0f && v >= 0.0f && u < static_cast<float>(width) &&
              v < static_cast<float>(height)))
            return false;
        const float fu = std::floor(u - 0.5f), fv = std::floor(v - 0.5f);
        const float tx = u - 0.5f - fu, ty = v - 0.5f - fv;
        const int px = static_cast<int>(fu), py = static_cast<int>(fv);
        const float a = (alpha(px, py) * (1 - tx) + alpha(px + 1, py) * tx) * (1 - ty) +
                        (alpha(px, py + 1) * (1 - tx) + alpha(px + 1, py + 1) * tx) * ty;
        if (!(a < level.free)) return false;
        if (!(a > 0.0f)) return true;
        for (int j = -1; j < 3; ++j)
            for (int i = -1; i < 3; ++i)
                if (alpha(px + i, py + j) >= level.solid) return true;
        return false;
    }
};

int countOf(const std::vector<Witness>& witnesses, float x, float y, float q) {
    int count = 0;
    for (const Witness& w : witnesses) count += w.seesBackground(x, y, q);
    return count;
}

/// Whether a view has background anywhere.
bool hasBackground(const Texture& texture, float freeLevel) {
    const auto pixels = static_cast<std::size_t>(texture.width()) * texture.height();
    for (std::size_t k = 0; k < pixels; ++k)
        if (texture.alpha(k) < freeLevel) return true;
    return false;
}

Image<float> kept(std::span<const NoisyView> views, const std::vector<bool>& saysAnything,
                  std::size_t number, const SilhouetteAlpha& alpha) {
    const NoisyView& view = views[number];
    std::vector<Witness> witnesses;
    for (std::size_t i = 0; i < views.size(); ++i) {
        if (i == number || !saysAnything[i]) continue;
        witnesses.push_back({views[i].texture, views[i].q->width(), views[i].q->height(),
                             warpFrom(views[i].space->pixelFromWorld * view.space->worldFromPixel),
                             alpha});
    }
    Image<float> out = *view.q;
    parallelForBlocks(0, out.height(), 16, [&](std::int64_t first, std::int64_t last) {
        for (int y = static_cast<int>(first); y < last; ++y) {
            for (int x = 0; x < out.width(); ++x) {
                const float q = view.q->at(x, y), doubt = view.surface.at(x, y).z;
                if (!(q > 0.0f) || !(doubt > 0.0f)) continue;
                const float u = static_cast<float>(x) + 0.5f, v = static_cast<float>(y) + 0.5f;
                int fewest = countOf(witnesses, u, v, q);
                float best = q;
                for (int k = 1; k <= 2 * kPlaces && fewest > 0; ++k) {
                    const auto steps = static_cast<float>((k + 1) / 2);
                    const float there =
                        q + (k % 2 ? -1.0f : 1.0f) * steps * (kFarthestDoubts / kPlaces) * doubt;
                    if (!(there > 0.0f)) continue;
                    const int count = countOf(witnesses, u, v, there);
                    if (count >= fewest) continue;
                    fewest = count;
                    best = there;
                }
                out.at(x, y) = best;
            }
        }
    });
    return out;
}

}  // namespace

void keepInSilhouettes(std::span<const NoisyView> views, const SilhouetteAlpha& alpha,
                       PixelSpool* spool) {
    std::vector<bool> saysAnything;
    for (const NoisyView& view : views)
        saysAnything.push_back(hasBackground(*view.texture, alpha.free));
    if (std::none_of(saysAnything.begin(), saysAnything.end(), [](bool says) { return says; }))
        return;
    std::vector<Image<float>> results;
    for (std::size_t i = 0; i < views.size(); ++i) {
        results.push_back(kept(views, saysAnything, i, alpha));
        results.back().moveTo(spool);
    }
    for (std::size_t i = 0; i < views.size(); ++i) *views[i].q = std::move(results[i]);
}

}  // namespace stx
