#pragma once

#include <cstdint>
#include <span>

#include "lib/base/image.hpp"
#include "lib/geometry/bounds.hpp"
#include "lib/geometry/camera.hpp"
#include "lib/geometry/depth_code.hpp"

namespace stx {

/// What a depth image holds.
struct DepthSummary {
    std::int64_t points = 0;  ///< values below kNoDepth
    /// The least and the largest of the points, scene units; kNoDepth and -kNoDepth without one.
    float nearest = kNoDepth, farthest = -kNoDepth;
    bool wrong = false;  ///< some value is NaN or below 0
};

[[nodiscard]] DepthSummary summariseDepth(std::span<const float> distances);

/// World bounds of the points of a depth image, to the bit those of ReferenceView::worldPoint();
/// empty without a point.
[[nodiscard]] Bounds boundsOfPoints(const Image<float>& distances, const Camera& camera);
/// The box around those that are not empty.
[[nodiscard]] Bounds boundsTogether(std::span<const Bounds> each);

/// Replaces the distance of each point by that of its code: decode(encode()), to the bit.
/// Precondition: `code` has farPlane > nearPlane, both finite.
void roundToCode(std::span<float> distances, const DepthCode& code);

}  // namespace stx
