#pragma once

#include <random>

#include <glm/gtc/quaternion.hpp>

#include "lib/geometry/camera.hpp"
#include "lib/model/splat_cloud.hpp"

namespace stx {

/// Splats of all shapes (needles, discs, balls) around the origin, with harmonics.
inline SplatCloud randomCloud(std::size_t count, int degree, unsigned seed) {
    std::mt19937 random(seed);
    const auto uniform = [&](double from, double to) {
        return from + (to - from) * (static_cast<double>(random()) / 4294967296.0);
    };
    SplatCloud cloud;
    (void)cloud.resize(count, degree, Limits());
    for (std::size_t i = 0; i < count; ++i) {
        const double size = std::exp(uniform(-4.5, -2.5));
        glm::dvec4 q;
        for (int k = 0; k < 3; ++k) {
            cloud.positions[i][k] = static_cast<float>(uniform(-1, 1));
            cloud.scales[i][k] = static_cast<float>(size * std::exp(uniform(-2.5, 0)));
            cloud.colours[i][k] = static_cast<float>(uniform(0, 1));
        }
        for (int k = 0; k < 4; ++k) q[k] = uniform(-1, 1);
        cloud.rotations[i] = glm::vec4(glm::normalize(q));
        cloud.opacities[i] = static_cast<float>(uniform(0.05, 1));
        for (int k = 0; k < SplatCloud::coefficientCount(degree); ++k)
            for (int c = 0; c < 3; ++c)
                cloud.setHarmonic(i, k, c, static_cast<float>(uniform(-0.15, 0.15)));
    }
    return cloud;
}

/// Looks at the origin from a place.
inline Camera cameraFrom(glm::dvec3 place, int width, int height) {
    Camera camera =
        Camera::fromFieldOfView(place, *lookAt(place, {0, 0, 0}), {0.8, 0.8}, false, width, height);
    return camera;
}

}  // namespace stx
