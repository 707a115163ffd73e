#pragma once

#include <optional>

#include <glm/glm.hpp>

#include "lib/geometry/pixel_space.hpp"
#include "lib/model/reference_view.hpp"
#include "lib/refine/noise.hpp"
#include "lib/surface/depth_gradient.hpp"

namespace stx {

/// What a view shows at a pixel with a point.
struct SurfacePoint {
    double dist = 0;     ///< planar distance
    float w = 0;         ///< see DepthSurface
    glm::vec2 gradient;  ///< of w
    bool sure = true;    ///< false: of noisy depth, and what is around it says otherwise
};

/// What a view shows: its depthSurface(), or the SmoothSurface of depth that is noisy, whose own
/// slopes are those of the noise.
class ViewSurface {
  public:
    /// The view must outlive it.
    explicit ViewSurface(const ReferenceView& view);
    ViewSurface(const ViewSurface&) = delete;
    ViewSurface& operator=(const ViewSurface&) = delete;
    /// How far off points are, one standard deviation: share of the distance; of orthographic
    /// views scene units. What refining left, else what depthNoise() measures; 0 of exact depth.
    [[nodiscard]] double noise() const { return noise_; }
    [[nodiscard]] SurfacePoint at(int x, int y) const;

  private:
    const ReferenceView& view_;
    double noise_ = 0;
    DepthSurface exact_;  ///< of exact depth
    DepthAxis axis_;      ///< this and what follows: of noisy depth
    float share_ = 0;     ///< the noise as a share of q
    Image<float> q_;
    std::optional<SmoothSurface> smooth_;
};

}  // namespace stx
