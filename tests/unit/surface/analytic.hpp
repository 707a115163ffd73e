#pragma once

#include <cmath>
#include <functional>

#include <glm/glm.hpp>

#include "lib/model/reference_view.hpp"

namespace stx::analytic {

/// A solid given by its signed distance (or a bound below it), with normals from its gradient.
using Solid = std::function<double(glm::dvec3)>;

inline double sphere(glm::dvec3 p) {
    return glm::length(p) - 1.0;
}
inline double torus(glm::dvec3 p) {
    const double ring = std::sqrt(p.x * p.x + p.z * p.z) - 0.75;
    return std::sqrt(ring * ring + p.y * p.y) - 0.3;
}
inline double bumpy(glm::dvec3 p) {
    const double bumps = std::sin(9 * p.x) * std::sin(8 * p.y + 1) * std::sin(7 * p.z + 2);
    return 0.6 * (glm::length(p) - 0.9 + 0.06 * bumps);
}
/// Two boxes, one behind the other: creases and a depth discontinuity.
inline double boxes(glm::dvec3 p) {
    const auto box = [](glm::dvec3 q, glm::dvec3 half) {
        const glm::dvec3 d = glm::abs(q) - half;
        return glm::length(glm::max(d, 0.0)) + std::min(0.0, std::max(d.x, std::max(d.y, d.z)));
    };
    return std::min(box(p - glm::dvec3(0.3, 0.1, 0.4), {0.3, 0.4, 0.2}),
                    box(p - glm::dvec3(-0.1, -0.1, -0.4), {0.7, 0.6, 0.2}));
}

inline glm::dvec3 normalOf(const Solid& solid, glm::dvec3 p) {
    const double e = 1e-5;
    const glm::dvec3 x(e, 0, 0), y(0, e, 0), z(0, 0, e);
    return glm::normalize(glm::dvec3(solid(p + x) - solid(p - x), solid(p + y) - solid(p - y),
                                     solid(p + z) - solid(p - z)));
}

/// A view of a solid that is within 1.2 of the origin: depth exact to 1e-7, then through the depth
/// code when depthBits is 8 or 16; `truth` gets the true normals. Colour is white.
inline ReferenceView capture(const Solid& solid, const Camera& camera, int depthBits,
                             Image<glm::vec3>* truth = nullptr) {
    ReferenceView view;
    view.camera = camera;
    view.depthBits = depthBits;
    view.depth = Image<float>(camera.width, camera.height, kNoDepth);
    Rgba8Image colour(camera.width, camera.height, glm::u8vec4(0));
    if (truth) *truth = Image<glm::vec3>(camera.width, camera.height, glm::vec3(0));
    double near = 1e9, far = 0;
    for (int y = 0; y < camera.height; ++y) {
        for (int x = 0; x < camera.width; ++x) {
            const glm::dvec3 from =
                camera.orthographic ? camera.unproject(x + 0.5, y + 0.5, 0) : glm::dvec3(0);
            const glm::dvec3 dir = glm::normalize(camera.unproject(x + 0.5, y + 0.5, 1) -
                                                  (camera.orthographic ? from : glm::dvec3(0)));
            const glm::dvec3 o = camera.position + camera.orientation * from;
            const glm::dvec3 d = camera.orientation * dir;
            const double middle = -glm::dot(o, d);
            double t = std::max(0.0, middle - 1.3);
            bool hit = false;
            for (int i = 0; i < 400 && t < middle + 1.3; ++i) {
                const double s = solid(o + d * t);
                if (s < 1e-8) {
                    hit = true;
                    break;
                }
                t += s;
            }
            if (!hit) continue;
            const double dist = -(from + dir * t).z;
            view.depth.at(x, y) = static_cast<float>(dist);
            colour.at(x, y) = glm::u8vec4(255);
            near = std::min(near, dist);
            far = std::max(far, dist);
            if (truth) truth->at(x, y) = glm::vec3(normalOf(solid, o + d * t));
        }
    }
    view.nearPlane = near < far ? near : 1.0;
    view.farPlane = near < far ? far : 2.0;
    if (depthBits < 32) {
        for (float& z : view.depth.pixels())
            z = static_cast<float>(view.depthCode().decode(view.depthCode().encode(z)));
    }
    view.texture = std::move(colour);
    return view;
}

inline Camera lookingAt(glm::dvec3 eye, int size, bool orthographic = false) {
    const auto q = lookAt(eye, {0, 0, 0});
    return Camera::fromFieldOfView(eye, *q, orthographic ? glm::dvec2(2.4) : glm::dvec2(0.75),
                                   orthographic, size, size);
}

}  // namespace stx::analytic
