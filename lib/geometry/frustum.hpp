#pragma once

#include <array>

#include "lib/geometry/bounds.hpp"
#include "lib/geometry/camera.hpp"

namespace stx {

/// The corners, in the world, of what a camera sees between two distances along its axis.
[[nodiscard]] std::array<glm::dvec3, 8> frustumCorners(const Camera& camera, double nearest,
                                                       double farthest);

/// Whether a camera sees nothing of a box between two distances: one of the six faces of what it
/// sees, or of the box, parts them by more than `slack` scene units. Some that an edge alone would
/// show to be apart are not found. Nothing is apart from an empty box.
[[nodiscard]] bool apart(const Camera& camera, double nearest, double farthest, const Bounds& box,
                         double slack);

}  // namespace stx
