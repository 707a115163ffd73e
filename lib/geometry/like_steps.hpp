#pragma once

#include <algorithm>
#include <cmath>

namespace stx {

/// Whether two steps of 1 / distance from pixel to pixel are of one slope: they differ by less than
/// a quarter of the larger. Of a plane they are equal in a pinhole's picture; in that of a fisheye
/// with a focal length of 60 pixels they differ by less up to 75 degrees off its axis, of 100
/// pixels by 3.5 % at 60 degrees. At an edge they differ by all of the step.
[[nodiscard]] inline bool likeSteps(float a, float b) {
    constexpr float kShare = 0.25f;
    return std::abs(a - b) <= kShare * std::max(std::abs(a), std::abs(b));
}

}  // namespace stx
