#include "lib/geometry/origin.hpp"

#include <algorithm>
#include <cmath>

namespace stx {

glm::dvec3 originFor(const Bounds& bounds) {
    constexpr double kFarOff = 64.0;
    if (bounds.empty()) return glm::dvec3(0.0);
    const auto size = bounds.max - bounds.min, centre = bounds.centre();
    const double largest = std::max({size.x, size.y, size.z});
    const double away = std::max({std::abs(centre.x), std::abs(centre.y), std::abs(centre.z)});
    if (!(largest > 0) || !std::isfinite(away) || !(away > kFarOff * largest))
        return glm::dvec3(0.0);
    const double step = std::pow(10.0, std::ceil(std::log10(largest)));
    if (!(step > 0) || !std::isfinite(away / step)) return glm::dvec3(0.0);
    // Adding 0 turns -0 into 0.
    return glm::round(centre / step) * step + 0.0;
}

}  // namespace stx
