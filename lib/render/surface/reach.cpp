#include "lib/render/surface/reach.hpp"

#include <algorithm>
#include <array>
#include <limits>

namespace stx {

bool mayShow(const Camera& c, std::span<const glm::dvec3> corners) {
    std::array<bool, 5> beyond{true, true, true, true, true};
    for (const glm::dvec3& corner : corners) {
        const glm::dvec3 p = glm::conjugate(c.orientation) * (corner - c.position);
        const double w = c.orthographic ? 1.0 : -p.z;
        const double x = c.fx * p.x + c.cx * w, y = -c.fy * p.y + c.cy * w;
        const double inside[] = {c.orthographic ? 1.0 : w, x + w, (c.width + 1) * w - x, y + w,
                                 (c.height + 1) * w - y};
        for (std::size_t k = 0; k < beyond.size(); ++k) beyond[k] = beyond[k] && inside[k] < 0;
    }
    return std::ranges::none_of(beyond, [](bool all) { return all; });
}

Reach::Reach(const surface::Source& source)
    : source_(&source),
      forward_(source.view->camera.forward()),
      position_(glm::dot(forward_, source.view->camera.position)) {
    float least = std::numeric_limits<float>::infinity(), most = 0;
    for (const float q : source.whole->q.pixels()) {
        if (!(q > 0)) continue;
        least = std::min(least, q);
        most = std::max(most, q);
    }
    const double a = source.space.axis.dist(least), b = source.space.axis.dist(most);
    nearest_ = std::min(a, b) - kSameSteps * source.step;
    farthest_ = std::max(a, b) + kSameSteps * source.step;
}

bool Reach::holds(std::span<const glm::dvec3> corners) const {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const glm::dvec3& corner : corners) {
        const double dist = distOf(corner);
        low = std::min(low, dist);
        high = std::max(high, dist);
    }
    return holds(low, high);
}

}  // namespace stx
