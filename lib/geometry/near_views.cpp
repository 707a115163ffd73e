#include "lib/geometry/near_views.hpp"

#include <algorithm>
#include <tuple>

namespace stx {
namespace {

/// Views from the other side see other surfaces: the largest distance of unit directions, that of
/// 120 degrees. Four views around an object are 90 degrees apart and share what lies between them:
/// with 90 the statue of tests/bench with noise of 0.5 % loses 0.24 dB in one view.
constexpr double kOtherSide = 1.732;

}  // namespace

std::vector<std::size_t> nearViews(std::size_t count,
                                   const std::function<const Camera&(std::size_t)>& camera,
                                   std::size_t number, const glm::dvec3& place, std::size_t most) {
    const auto towards = [&](const Camera& c) {
        return c.orthographic ? c.forward() : glm::normalize(place - c.position);
    };
    const Camera& own = camera(number);
    const glm::dvec3 look = towards(own);
    std::vector<std::tuple<double, double, std::size_t>> ranked;
    for (std::size_t i = 0; i < count; ++i) {
        const Camera& other = camera(i);
        if (i == number) continue;
        if (!other.orthographic && !(glm::dot(place - other.position, other.forward()) > 0))
            continue;
        const double turned = glm::distance(look, towards(other));
        if (turned < kOtherSide)
            ranked.emplace_back(turned, glm::distance(own.position, other.position), i);
    }
    const std::size_t kept = std::min(ranked.size(), most);
    std::partial_sort(ranked.begin(), ranked.begin() + static_cast<std::ptrdiff_t>(kept),
                      ranked.end());
    std::vector<std::size_t> near;
    for (std::size_t k = 0; k < kept; ++k) near.push_back(std::get<2>(ranked[k]));
    return near;
}

}  // namespace stx
