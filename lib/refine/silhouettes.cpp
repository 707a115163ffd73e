#include "lib/refine/silhouettes.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "lib/base/parallel.hpp"
#include "lib/geometry/near_views.hpp"

namespace stx {
namespace {

// Chosen by trial on the sets of tests/bench/pictures.md with noise added.

/// Places are looked at up to so many standard deviations away, so many on each side.
constexpr float kFarthestDoubts = 6.0f;
constexpr int kPlaces = 16;
/// Views that a view is held against. Spot from 256 places, depth with noise of 0.5 %, in dB of
/// `best` and of splats: 47.05, 37.2 of 32; 47.4, 38.0 of 64; 47.6, 38.45 of 128; 47.7, 38.4 of
/// all. The nearest 64 instead: 47.25, 37.1.
constexpr std::size_t kMostWitnesses = 64;

/// What a view shows between the middles of four pixels, (x, y) being the last of them.
enum class Shown : std::uint8_t {
    object,      ///< of all four alpha is above `free`
    background,  ///< of all four it is 0
    outline
};
using ShownMap = Image<Shown>;

/// Alpha as far above `free` is above it between pixels, too, whatever rounding does.
constexpr float kRounding = 1e-4f;

/// One column and row more than the view has.
ShownMap shownBy(const Texture& texture, float freeLevel) {
    const int width = texture.width(), height = texture.height();
    const auto kindOf = [&](int x, int y) {
        const float a = texture.alpha(static_cast<std::size_t>(y) * width + x);
        return a >= freeLevel + kRounding ? Shown::object
               : a > 0.0f                 ? Shown::outline
                                          : Shown::background;
    };
    ShownMap out(width + 1, height + 1);
    parallelFor(0, out.height(), 32, [&](int y) {
        const int above = std::max(y - 1, 0), below = std::min(y, height - 1);
        for (int x = 0; x <= width; ++x) {
            const int left = std::max(x - 1, 0), right = std::min(x, width - 1);
            const Shown a = kindOf(left, above);
            const bool alike =
                a == kindOf(right, above) && a == kindOf(left, below) && a == kindOf(right, below);
            out.at(x, y) = alike ? a : Shown::outline;
        }
    });
    return out;
}

/// A view that may see background at a point.
struct Witness {
    const Texture* texture;
    const ShownMap* shown;
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
        const int px = static_cast<int>(fu), py = static_cast<int>(fv);
        const Shown kind = shown->at(px + 1, py + 1);
        if (kind != Shown::outline) return kind == Shown::background;
        const float tx = u - 0.5f - fu, ty = v - 0.5f - fv;
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

/// How many see background at a point, or `most` where they are more.
std::ptrdiff_t countOf(std::span<const Witness* const> witnesses, float x, float y, float q,
                       std::ptrdiff_t most) {
    std::ptrdiff_t count = 0;
    for (const Witness* w : witnesses) {
        count += w->seesBackground(x, y, q);
        if (count >= most) break;
    }
    return count;
}

/// Whether a view has background anywhere.
bool hasBackground(const Texture& texture, float freeLevel) {
    const auto pixels = static_cast<std::size_t>(texture.width()) * texture.height();
    for (std::size_t k = 0; k < pixels; ++k)
        if (texture.alpha(k) < freeLevel) return true;
    return false;
}

/// `shown`: of each view; empty of those that say nothing.
Image<float> kept(std::span<const NoisyView> views, std::span<const ShownMap> shown,
                  std::size_t number, const SilhouetteAlpha& alpha, PixelSpool* spool) {
    const NoisyView& view = views[number];
    std::vector<std::size_t> telling{number};
    for (std::size_t i = 0; i < views.size(); ++i)
        if (i != number && !shown[i].empty()) telling.push_back(i);
    const auto camera = [&](std::size_t k) -> const Camera& {
        return views[telling[k]].space->camera;
    };
    std::vector<Witness> witnesses;
    for (const std::size_t k :
         viewsAround(telling.size(), camera, 0, middleOf(view), kMostWitnesses)) {
        const std::size_t i = telling[k];
        witnesses.push_back({views[i].texture, &shown[i], views[i].q->width(), views[i].q->height(),
                             warpFrom(views[i].space->pixelFromWorld * view.space->worldFromPixel),
                             alpha});
    }
    std::vector<const Witness*> inOrder;
    for (const Witness& w : witnesses) inOrder.push_back(&w);
    Image<float> out = *view.q;
    forRows(out, spool, [&](int y) {
        std::vector<const Witness*> asked = inOrder;
        for (int x = 0; x < out.width(); ++x) {
            const float q = view.q->at(x, y), doubt = view.surface.at(x, y).z;
            if (!(q > 0.0f) || !(doubt > 0.0f)) continue;
            const float u = static_cast<float>(x) + 0.5f, v = static_cast<float>(y) + 0.5f;
            // Those that see background here come first: they are likely to see it nearby, too.
            const auto others = std::partition(asked.begin(), asked.end(), [&](const Witness* w) {
                return w->seesBackground(u, v, q);
            });
            std::ptrdiff_t fewest = others - asked.begin();
            float best = q;
            for (int k = 1; k <= 2 * kPlaces && fewest > 0; ++k) {
                const auto steps = static_cast<float>((k + 1) / 2);
                const float there =
                    q + (k % 2 ? -1.0f : 1.0f) * steps * (kFarthestDoubts / kPlaces) * doubt;
                if (!(there > 0.0f)) continue;
                const std::ptrdiff_t count = countOf(asked, u, v, there, fewest);
                if (count >= fewest) continue;
                fewest = count;
                best = there;
            }
            out.at(x, y) = best;
        }
    });
    return out;
}

}  // namespace

void keepInSilhouettes(std::span<const NoisyView> views, const SilhouetteAlpha& alpha,
                       PixelSpool* spool) {
    std::vector<ShownMap> shown(views.size());
    for (std::size_t i = 0; i < views.size(); ++i) {
        if (!hasBackground(*views[i].texture, alpha.free)) continue;
        shown[i] = shownBy(*views[i].texture, alpha.free);
        shown[i].moveTo(spool);
    }
    if (std::ranges::all_of(shown, &ShownMap::empty)) return;
    std::vector<Image<float>> results;
    for (std::size_t i = 0; i < views.size(); ++i) {
        results.push_back(kept(views, shown, i, alpha, spool));
        results.back().moveTo(spool);
    }
    for (std::size_t i = 0; i < views.size(); ++i) *views[i].q = std::move(results[i]);
}

}  // namespace stx
