#pragma once

#include "lib/geometry/camera.hpp"
#include "lib/render/api/frame.hpp"

namespace stx::surface {

/// Gives pixels that are covered and have a depth, but no normal, the mean of the normals beside
/// them on the same surface: of the 3x3 pixels around or, without any, of the 5x5. Such a pixel was
/// drawn from texels without normals, as pruned views have around what they keep. What is farther
/// from all normals stays without. The same on any number of threads.
void borrowNormals(const Camera& camera, Frame& frame);

}  // namespace stx::surface
