#include "lib/geometry/sway.hpp"

#include <cmath>
#include <numbers>

namespace stx {
namespace {

/// Height of the ellipse over its width: people's eyes move to the side, and skies and floors,
/// which the upper and lower border show, have little to fill a gap from.
constexpr double kHeight = 0.5;

}  // namespace

Result<std::vector<Camera>> swayCameras(const Camera& from, double distance, double reach,
                                        int count) {
    for (const double value : {distance, reach}) {
        if (!(value > 0 && std::isfinite(value)))
            return fail(ErrorCode::invalidInput,
                        "the cameras sway by {:g} of the distance {:g}; both must be above 0",
                        reach, distance);
    }
    const glm::dvec3 target = from.position + distance * from.forward();
    const glm::dvec3 right = from.orientation * glm::dvec3(1, 0, 0),
                     up = from.orientation * glm::dvec3(0, 1, 0);
    std::vector<Camera> out;
    for (int i = 0; i < count; ++i) {
        const double angle = 2 * std::numbers::pi * i / count;
        Camera camera = from;
        camera.position +=
            reach * distance * (std::cos(angle) * right + kHeight * std::sin(angle) * up);
        STX_TRY(camera.orientation, lookAt(camera.position, target, up));
        out.push_back(camera);
    }
    return out;
}

}  // namespace stx
