#pragma once

#include <glm/glm.hpp>

#include "lib/model/splat_cloud.hpp"

namespace stx {

/// Moves, turns and scales the splats from `first` on, with their sizes and harmonics. A transform
/// that stretches gives each splat the axes of its stretched covariance.
void transformSplats(SplatCloud& cloud, std::size_t first, const glm::dmat4& worldFromCloud);

}  // namespace stx
