#pragma once

#include <vector>

#include "lib/base/result.hpp"
#include "lib/geometry/camera.hpp"

namespace stx {

/// Cameras that sway around a picture's own pose, as far as one photograph with depth bears:
/// `count` on an ellipse in its image plane, all of its lens and size, that look at the point of
/// its axis `distance` scene units ahead, so that what is there stays in its place. The first is on
/// the right, the next ones go up and around; after the last comes the first again. `reach`: half
/// of the ellipse's width, as a share of `distance`; it is half as high. Errors (invalidInput): a
/// distance or a reach that is not above 0 and finite.
[[nodiscard]] Result<std::vector<Camera>> swayCameras(const Camera& from, double distance,
                                                      double reach, int count);

}  // namespace stx
