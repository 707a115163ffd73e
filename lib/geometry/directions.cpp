#include "lib/geometry/directions.hpp"

#include <cmath>

#include <glm/gtc/constants.hpp>

namespace stx {

glm::dvec3 faceDirection(CubeFace face, glm::dvec2 position) {
    const double a = 2.0 * position.x - 1.0, b = 1.0 - 2.0 * position.y;
    switch (face) {
        case CubeFace::front:
            return {a, b, -1};
        case CubeFace::back:
            return {-a, b, 1};
        case CubeFace::left:
            return {-1, b, -a};
        case CubeFace::right:
            return {1, b, a};
        case CubeFace::top:
            return {a, 1, b};
        case CubeFace::bottom:
            break;
    }
    return {a, -1, -b};
}

FacePosition facePosition(glm::dvec3 d) {
    const glm::dvec3 size = glm::abs(d);
    FacePosition at;
    double a = 0, b = 0;
    if (size.z >= size.x && size.z >= size.y) {
        at.face = d.z < 0 ? CubeFace::front : CubeFace::back;
        a = (d.z < 0 ? d.x : -d.x) / size.z;
        b = d.y / size.z;
    } else if (size.x >= size.y) {
        at.face = d.x < 0 ? CubeFace::left : CubeFace::right;
        a = (d.x < 0 ? -d.z : d.z) / size.x;
        b = d.y / size.x;
    } else {
        at.face = d.y > 0 ? CubeFace::top : CubeFace::bottom;
        a = d.x / size.y;
        b = (d.y > 0 ? d.z : -d.z) / size.y;
    }
    at.position = {0.5 * (a + 1.0), 0.5 * (1.0 - b)};
    return at;
}

glm::dvec3 latlongDirection(glm::dvec2 p) {
    const double longitude = (p.x - 0.5) * glm::two_pi<double>();
    const double latitude = (0.5 - p.y) * glm::pi<double>();
    return {std::cos(latitude) * std::sin(longitude), std::sin(latitude),
            -std::cos(latitude) * std::cos(longitude)};
}

glm::dvec2 latlongPosition(glm::dvec3 d) {
    const double longitude = std::atan2(d.x, -d.z);
    const double latitude = std::atan2(d.y, std::hypot(d.x, d.z));
    return {0.5 + longitude / glm::two_pi<double>(), 0.5 - latitude / glm::pi<double>()};
}

}  // namespace stx
