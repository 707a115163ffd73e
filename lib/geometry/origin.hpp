#pragma once

#include "lib/geometry/bounds.hpp"

namespace stx {

/// What to subtract, in double precision, from the coordinates of an object in this box before
/// floats hold them: 0 while floats are fine. They are not when an axis of the box's centre is more
/// than 64 times the box's largest side away from 0: then the 24 bits of a float leave fewer than
/// 2^18 steps along that side, and the sums of a renderer fewer still. The origin is near the
/// centre and has few digits: multiples of the power of ten that is not below the largest side.
/// Axes that floats hold well get 0 where that rounds to 0. A box without a size has the origin 0.
[[nodiscard]] glm::dvec3 originFor(const Bounds& bounds);

}  // namespace stx
