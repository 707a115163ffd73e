#include "lib/refine/noisy_views.hpp"

#include "lib/base/parallel.hpp"
#include "lib/geometry/near_views.hpp"

namespace stx {
namespace {

/// Every how many pixels the middle of a view is taken from, in both directions.
constexpr int kMiddleStep = 7;

}  // namespace

glm::dvec3 middleOf(const NoisyView& view) {
    glm::dvec3 sum(0.0);
    std::int64_t points = 0;
    for (int y = kMiddleStep / 2; y < view.q->height(); y += kMiddleStep) {
        for (int x = kMiddleStep / 2; x < view.q->width(); x += kMiddleStep) {
            const float q = view.q->at(x, y);
            if (!(q > 0.0f)) continue;
            const glm::dvec4 p = view.space->worldFromPixel * glm::dvec4(x + 0.5, y + 0.5, q, 1.0);
            sum += glm::dvec3(p) / p.w;
            ++points;
        }
    }
    return points > 0 ? sum / static_cast<double>(points) : view.space->camera.position;
}

std::vector<std::size_t> nearViews(std::span<const NoisyView> views, std::size_t number,
                                   std::size_t most) {
    return nearViews(
        views.size(), [&](std::size_t i) -> const Camera& { return views[i].space->camera; },
        number, middleOf(views[number]), most);
}

void forRows(const Image<float>& of, PixelSpool* spool, const std::function<void(int)>& body) {
    constexpr std::int64_t kRows = 16;
    parallelForBlocks(0, of.height(), kRows, [&](std::int64_t first, std::int64_t last) {
        if (spool) spool->settle();
        for (int y = static_cast<int>(first); y < last; ++y) body(y);
    });
}

std::vector<Partner> partnersOf(std::span<const NoisyView> views, std::size_t number) {
    constexpr std::size_t kMost = 8;
    std::vector<Partner> partners;
    for (const std::size_t i : nearViews(views, number, kMost))
        partners.push_back({&views[i], warpFrom(views[i].space->pixelFromWorld *
                                                views[number].space->worldFromPixel)});
    return partners;
}

ShownSurface surfaceShownBy(const NoisyView& other, const Warp& warp, float x, float y, float q) {
    ShownSurface s;
    const glm::vec4 h = warp.homogeneous(x, y, q);
    if (!(h.w > 0.0f)) return s;
    const auto& m = warp.m;
    s.inverse = 1.0f / h.w;
    s.u = h.x * s.inverse;
    s.v = h.y * s.inverse;
    s.there = h.z * s.inverse;
    const Image<float>& image = *other.q;
    if (!(s.u >= 0.0f && s.v >= 0.0f && s.u < static_cast<float>(image.width()) &&
          s.v < static_cast<float>(image.height())))
        return s;
    s.inside = true;
    const int px = static_cast<int>(s.u), py = static_cast<int>(s.v);
    s.shown = image.at(px, py);
    if (!(s.shown > 0.0f)) return s;
    const glm::vec3 plane = other.surface.at(px, py);
    const float expected = s.shown + plane.x * (s.u - static_cast<float>(px) - 0.5f) +
                           plane.y * (s.v - static_cast<float>(py) - 0.5f);
    s.off = expected - s.there;
    s.rate = ((m[10] - s.there * m[14]) - plane.x * (m[2] - s.u * m[14]) -
              plane.y * (m[6] - s.v * m[14])) *
             s.inverse;
    s.doubt = plane.z;
    s.found = true;
    return s;
}

}  // namespace stx
