#pragma once

#include <glm/glm.hpp>

namespace stx::splats {

/// Values of the real harmonics of the degrees 1 to `degree` (with the Condon-Shortley phase) in a
/// direction from the viewpoint, which is unit: SplatCloud::paddedCount() of them, zeros behind
/// coefficientCount().
void harmonicsBasis(glm::dvec3 direction, int degree, float* basis);

}  // namespace stx::splats
