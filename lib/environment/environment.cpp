#include "lib/environment/environment.hpp"

#include <algorithm>
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

bool Environment::linear() const {
    return std::ranges::any_of(pictures,
                               [](const Texture& t) { return !t.empty() && t.isLinear(); });
}

int Environment::pictureCount() const {
    return static_cast<int>(
        std::ranges::count_if(pictures, [](const Texture& t) { return !t.empty(); }));
}

Result<void> Environment::check() const {
    const std::size_t expected = layout == Layout::cube ? 6 : 1;
    if (!pictures.empty() && pictures.size() != expected)
        return fail(ErrorCode::invalidInput, "an environment of {} picture(s); {} expected",
                    pictures.size(), layout == Layout::cube ? "six faces are" : "one is");
    if (pictureCount() == 0 && skyColours.empty() && groundColours.empty())
        return fail(ErrorCode::invalidInput,
                    "an environment has no picture, no sky and no ground; one of them is expected");
    for (const Texture& t : pictures)
        if (!t.empty() && t.isLinear() != linear())
            return fail(ErrorCode::invalidInput,
                        "an environment has pictures of 8-bit sRGB and of linear light; all must "
                        "be alike");
    const double length = orientation.w * orientation.w + orientation.x * orientation.x +
                          orientation.y * orientation.y + orientation.z * orientation.z;
    if (!(std::abs(length - 1.0) < 1e-4))
        return fail(ErrorCode::invalidInput,
                    "the orientation of an environment is not a rotation: its quaternion has the "
                    "length {:g}",
                    std::sqrt(length));
    for (const auto& [what, colours, angles] :
         {std::tuple{"sky", &skyColours, &skyAngles},
          std::tuple{"ground", &groundColours, &groundAngles}}) {
        if (colours->empty() ? !angles->empty() : angles->size() + 1 != colours->size())
            return fail(ErrorCode::invalidInput,
                        "the {} of an environment has {} colours and {} angles; one angle less "
                        "than colours is expected",
                        what, colours->size(), angles->size());
        double before = 0;
        for (const double angle : *angles) {
            if (!(angle >= before && angle <= 3.1416))
                return fail(ErrorCode::invalidInput,
                            "the {} of an environment has the angle {:g} after {:g}; angles rise "
                            "from 0 to 3.1416",
                            what, angle, before);
            before = angle;
        }
        for (const glm::vec3& c : *colours)
            if (!(std::isfinite(c.x + c.y + c.z)))
                return fail(ErrorCode::invalidInput,
                            "the {} of an environment has a colour that is not finite", what);
    }
    return {};
}

}  // namespace stx
