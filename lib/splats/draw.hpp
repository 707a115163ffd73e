#pragma once

#include <glm/glm.hpp>

#include "lib/base/image.hpp"
#include "lib/base/job.hpp"
#include "lib/geometry/camera.hpp"
#include "lib/model/splat_cloud.hpp"

namespace stx {

/// A cloud of splats seen by a camera.
struct SplatPicture {
    /// In the cloud's own space (sRGB-coded, or linear light where SplatCloud::linear), in which
    /// what is behind is to be added, premultiplied by what the splats cover (alpha); beyond 1
    /// where harmonics lead.
    Image<glm::vec4> colour;
    /// Planar distance, kNoDepth where the splats let half of what is behind them through: that of
    /// the splat at which the transmittance falls below one half, where the pixel's ray comes
    /// nearest to its centre, measured in its own standard deviations, and no more than three of
    /// these from it along the axis. On a flat splat that is its plane.
    Image<float> depth;
    Image<glm::vec3> normal;  ///< of that splat's shortest axis, towards the camera; may be empty
};

/// Draws a cloud by the published rules (Kerbl et al. 2023; KHR_gaussian_splatting, kernel
/// ellipse): covariance J W S Wt Jt + 0.3 square pixels, cut at 3 standard deviations and below an
/// alpha of 1/255, an alpha of at most 0.99, sorted by the distance of centres from the viewpoint
/// (orthographic: by depth) and blended front to back in the colours' own space. Splats whose
/// centre is not further in front of the viewpoint than their standard deviation along the axis are
/// not drawn: the projection does not hold for them. The same picture on any number of threads.
///
/// The cloud must have passed dropBroken(). Errors: a camera that fails check(), memory over the
/// limit, cancelled.
[[nodiscard]] Result<SplatPicture> drawSplats(const SplatCloud& cloud, const Camera& camera,
                                              bool normals, Job& job);

}  // namespace stx
