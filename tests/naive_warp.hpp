#pragma once

#include <cmath>

#include "lib/base/image.hpp"
#include "lib/model/reference_view.hpp"

/// A picture that was warped, black and transparent where nothing came to lie.
struct NaiveWarp {
    stx::Image<glm::u8vec4> picture;
    stx::Image<std::uint8_t> covered;  ///< 255 or 0
    stx::Image<float> distance;        ///< stx::kNoDepth where nothing came to lie
};

/// What every renderer must beat: each pixel with a point, carried by its own depth to the pixel of
/// the other camera that it falls into; the nearest point wins. `view` must have an 8-bit texture.
inline NaiveWarp naiveWarp(const stx::ReferenceView& view, const stx::Camera& to) {
    NaiveWarp out{stx::Image<glm::u8vec4>(to.width, to.height, glm::u8vec4(0)),
                  stx::Image<std::uint8_t>(to.width, to.height, 0),
                  stx::Image<float>(to.width, to.height, stx::kNoDepth)};
    stx::Image<float>& nearest = out.distance;
    const stx::Rgba8Image& texture = *view.texture.rgba8();
    const glm::dmat4 cameraFromWorld = to.cameraFromWorld();
    for (int y = 0; y < view.depth.height(); ++y) {
        for (int x = 0; x < view.depth.width(); ++x) {
            if (!stx::hasPoint(view.depth.at(x, y))) continue;
            const glm::dvec3 p(cameraFromWorld * glm::dvec4(view.worldPoint(x, y), 1));
            if (!(p.z < 0)) continue;
            const glm::dvec3 at = to.project(p);
            const int u = static_cast<int>(std::floor(at.x));
            const int v = static_cast<int>(std::floor(at.y));
            if (!out.picture.contains(u, v) || nearest.at(u, v) <= at.z) continue;
            nearest.at(u, v) = static_cast<float>(at.z);
            out.picture.at(u, v) = texture.at(x, y);
            out.covered.at(u, v) = 255;
        }
    }
    return out;
}
