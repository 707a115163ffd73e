#pragma once

#include <cstdint>

#include <glm/glm.hpp>

#include "lib/base/image.hpp"
#include "lib/base/job.hpp"
#include "lib/model/reference_view.hpp"
#include "lib/surface/normals.hpp"

namespace stx {

/// A depth image as a surface: per pixel w, which is affine in pixels on a plane, and its gradient.
/// w = 1 / distance in perspective, the distance itself in orthographic views.
struct DepthSurface {
    /// The pixel and its right neighbour are one surface.
    static constexpr std::uint8_t kRight = 1;
    static constexpr std::uint8_t kDown = 2;  ///< the pixel and the one below it are one surface

    Image<float> w;             ///< NaN where there is no point; of steps, a smoothed w
    Image<std::uint8_t> links;  ///< kRight, kDown
    Image<glm::vec2> gradient;  ///< w per pixel along x and along y; zero where there is no point
    /// Scene units between the distances that the image can hold (the depth code's step when the
    /// distances lie on it, else the resolution of a float).
    double step = 0;
};

/// w of a distance: 1 / dist, or dist when orthographic.
[[nodiscard]] inline double affineDepth(const Camera& camera, double dist) {
    return camera.orthographic ? dist : 1.0 / dist;
}

/// Links and gradients of a view. Pixels whose distances differ by more than `discontinuity` (share
/// of the distance) beyond what the slope beside them explains are not linked. Pixels without links
/// along an axis get the slope of a surface that faces the viewpoint. When `job`, where there is
/// one, is cancelled, it ends early, and what it gives is of no use: who gives a job looks at it.
[[nodiscard]] DepthSurface depthSurface(const ReferenceView& view, const BakeSettings& settings,
                                        const Job* job = nullptr);

/// Gives pixels that are linked with no other along an axis, at outlines mostly, the slope along it
/// of the neighbour that comes nearest to their depth when it goes on straight, in place of that of
/// a surface that faces the viewpoint: what is beside an outline turns away. Pixels without any
/// neighbour whose slope is known stay as they are.
void continueSlopes(const Camera& camera, DepthSurface& surface);

/// Unit normal in camera space, towards the viewpoint, of the plane through pixel (x, y)'s centre
/// with the given w and gradient.
[[nodiscard]] glm::dvec3 planeNormal(const Camera& camera, int x, int y, double w,
                                     glm::dvec2 gradient);

/// The vectors in camera space from the point of pixel (x, y) to where its plane meets the lines of
/// sight one pixel further along x and along y (to first order).
struct PixelSteps {
    glm::dvec3 alongX, alongY;  ///< scene units
};
[[nodiscard]] PixelSteps planeSteps(const Camera& camera, int x, int y, double w,
                                    glm::dvec2 gradient);

}  // namespace stx
