#pragma once

#include "lib/base/image.hpp"

namespace stx {

/// How far smoothDepthSteps() moves a value at most: below half a step, so that rounding gives back
/// what was stored.
inline constexpr float kMostStepShift = 0.49f;

/// Undoes the stairs of coarsely stored depth: a slanted surface kept in whole numbers is a
/// staircase, whose treads all face the camera and whose points lie off the surface by up to half a
/// step. `codes` holds the stored whole numbers (8-bit disparities, normalised disparity, any code
/// that is smooth along surfaces), kNoDepth = unknown. Each becomes the value within kMostStepShift
/// of it (and between the least and the largest stored) that makes the surface smoothest: the
/// membrane over links between 4-neighbours up to two steps apart, held to the stored value where
/// no stair is near. Larger jumps are depth edges, nothing is carried across them. Unknown stays
/// unknown. The same on any number of threads.
void smoothDepthSteps(Image<float>& codes);

}  // namespace stx
