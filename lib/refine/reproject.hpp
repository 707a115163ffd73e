#pragma once

#include <functional>

#include "lib/base/image.hpp"
#include "lib/base/job.hpp"
#include "lib/geometry/camera.hpp"

namespace stx {

/// Where a pixel position of an ideal pinhole is in the picture of a real lens; null: right there.
using RealFromIdeal = std::function<glm::dvec2(glm::dvec2 pixel)>;

/// The depth that one camera took, as another one beside it sees it: each pixel is the little face
/// that it covers of its surface, the nearest face wins. Nothing lies between two surfaces; what
/// the first camera did not see stays kNoDepth. `from` has the depth's size; `lens` is that of
/// `to`. Errors: the job is cancelled.
[[nodiscard]] Result<Image<float>> depthSeenBy(const Camera& to, const RealFromIdeal& lens,
                                               const Image<float>& depth, const Camera& from,
                                               Job& job);

}  // namespace stx
