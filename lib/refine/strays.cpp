#include "lib/refine/strays.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace stx {
namespace {

/// A point lies on one surface with a neighbour whose q differs by no more than so many standard
/// deviations of both and so many pixels' sizes, and so many of eight neighbours must. Splats of
/// statue and oak tree with noise of 0.5 % and 2 %: 37.65, 34.27, 26.36, 25.66 dB; of 4 neighbours
/// 37.19, 34.48, 25.74, 25.37; with 2 deviations and 4 neighbours 37.85, 34.00, 26.08, 25.44;
/// without this step 37.03, 32.39, 25.72, 24.84.
constexpr float kDoubts = 1.0f, kPixels = 1.0f;
constexpr int kLeastAlike = 3;
/// On a steep surface opposite neighbours differ by more, but are as much before as behind the
/// point: up to so many pixels' sizes, where what hangs between two surfaces does the same. Balls
/// and plates of 40 to 60 pixels with noise of 0.2 % lost their sides without: 18.2 and 12.0 dB
/// instead of 50.8 and 26.8.
constexpr float kSteepest = 5.0f;

/// A point with so many may be on a surface that is seen from aside, whose edge in another view is
/// known to a pixel at best: the side of a box was taken away, 29.6 dB instead of 41.1
/// (tests/sweep, 5001:160). Splats of statue and oak tree as above: 37.92, 33.99, 26.47, 25.52 dB;
/// of all points 37.83, 33.94, 26.32, 25.42, of none 37.96, 34.01, 26.49, 25.57.
constexpr int kSomeAlike = 2;
constexpr int kAcrossPoint[4][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};

/// Another view sees past a stray when its surface is behind it by more than so many standard
/// deviations of both.
constexpr float kBand = 3.0f;

/// How many of the points around a point are on one surface with it.
int alikeAround(const NoisyView& view, int x, int y) {
    const Image<float>& from = *view.q;
    const DepthAxis& axis = view.space->axis;
    const float q = from.at(x, y), own = view.surface.at(x, y).z;
    const float pixel = axis.pixelShare() * axis.relativeScale(q);
    int alike = 0;
    for (const auto& [dx, dy] : {std::pair(1, 0), {0, 1}, {1, 1}, {1, -1}}) {
        float sum = 0, most = 0, within = 0;
        int there = 0, near = 0;  // of both neighbours
        for (const int side : {-1, 1}) {
            const int u = x + side * dx, v = y + side * dy;
            if (!from.contains(u, v) || !(from.at(u, v) > 0.0f)) continue;
            const float apart = from.at(u, v) - q;
            const float allowed =
                kDoubts * std::hypot(own, view.surface.at(u, v).z) + kPixels * pixel;
            ++there;
            near += std::abs(apart) <= allowed;
            sum += apart;
            most = std::max(most, std::abs(apart));
            within = std::max(within, allowed);
        }
        const bool steep = there == 2 && most <= kSteepest * pixel && std::abs(sum) <= 2 * within;
        alike += steep ? 2 : near;
    }
    return alike;
}

/// Whether a pixel and those beside it show background; what is not known is below 0.
bool isClear(const Image<float>& q, int x, int y) {
    const auto isEmpty = [&](int u, int v) { return !q.contains(u, v) || q.at(u, v) == 0.0f; };
    return isEmpty(x, y) && std::ranges::all_of(kAcrossPoint, [&](const auto& side) {
               return isEmpty(x + side[0], y + side[1]);
           });
}

/// Whether another view sees past a point; `around`: in the pixels beside that, too.
bool isSeenPast(const Partner& p, const NoisyView& view, int x, int y, bool around) {
    const float q = view.q->at(x, y), own = view.surface.at(x, y).z;
    const ShownSurface s = surfaceShownBy(*p.view, p.warp, static_cast<float>(x) + 0.5f,
                                          static_cast<float>(y) + 0.5f, q);
    const int u = static_cast<int>(s.u), v = static_cast<int>(s.v);
    if (!s.found) return s.inside && isClear(*p.view->q, u, v);
    const float band = kBand * std::hypot(own * s.rate, s.doubt);
    if (!(s.off < -band)) return false;
    if (!around) return true;
    const Image<float>& shown = *p.view->q;
    return std::ranges::none_of(kAcrossPoint, [&](const auto& side) {
        const int i = u + side[0], j = v + side[1];
        return shown.contains(i, j) && shown.at(i, j) > s.there - band;
    });
}

/// The strays of one view.
Image<std::uint8_t> straysOf(std::span<const NoisyView> views, std::size_t number,
                             PixelSpool* spool) {
    const NoisyView& view = views[number];
    const std::vector<Partner> partners = partnersOf(views, number);
    Image<std::uint8_t> strays(view.q->width(), view.q->height(), 0);
    forRows(*view.q, spool, [&](int y) {
        for (int x = 0; x < strays.width(); ++x) {
            if (!(view.q->at(x, y) > 0.0f)) continue;
            const int alike = alikeAround(view, x, y);
            if (alike >= kLeastAlike) continue;
            strays.at(x, y) = std::ranges::any_of(partners, [&](const Partner& p) {
                return isSeenPast(p, view, x, y, alike >= kSomeAlike);
            });
        }
    });
    return strays;
}

}  // namespace

std::int64_t removeStrays(std::span<const NoisyView> views, PixelSpool* spool) {
    std::vector<Image<std::uint8_t>> strays;
    for (std::size_t i = 0; i < views.size(); ++i) {
        strays.push_back(straysOf(views, i, spool));
        strays.back().moveTo(spool);
    }
    std::int64_t removed = 0;
    for (std::size_t i = 0; i < views.size(); ++i) {
        for (std::size_t k = 0; k < strays[i].count(); ++k) {
            if (!strays[i].data()[k]) continue;
            views[i].q->data()[k] = -1.0f;
            ++removed;
        }
    }
    return removed;
}

}  // namespace stx
