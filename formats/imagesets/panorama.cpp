#include "formats/imagesets/panorama.hpp"

#include <algorithm>
#include <cmath>

#include <glm/gtc/constants.hpp>

#include "lib/render/around/around.hpp"

namespace stx::imagesets {

bool Panorama::closed() const {
    return left - right > glm::two_pi<double>() - 1e-6;
}

glm::dvec3 Panorama::direction(glm::dvec2 p) const {
    const double longitude = left + (right - left) * p.x;
    const double latitude = top + (bottom - top) * p.y;
    return {-std::cos(latitude) * std::sin(longitude), std::sin(latitude),
            -std::cos(latitude) * std::cos(longitude)};
}

glm::dvec2 Panorama::position(glm::dvec3 d) const {
    double longitude = std::atan2(-d.x, -d.z);
    // Ranges need not be centred on 0.
    const double centre = 0.5 * (left + right);
    longitude -= glm::two_pi<double>() * std::round((longitude - centre) / glm::two_pi<double>());
    const double latitude = std::atan2(d.y, std::hypot(d.x, d.z));
    return {(longitude - left) / (right - left), (latitude - top) / (bottom - top)};
}

std::vector<Camera> cubeFaces(const Camera& pose, const Panorama& panorama, int width, int height) {
    // The middle of a face has f pixels per radian.
    const double perRadian = std::max(width / (panorama.left - panorama.right),
                                      height / (panorama.top - panorama.bottom));
    return facesAround(pose, std::max(1, static_cast<int>(std::lround(perRadian))));
}

}  // namespace stx::imagesets
