#pragma once

#include <cstdint>
#include <span>

namespace stx {

/// Half floats of as many values from `from` on, rounded to the nearest, ties to even; beyond their
/// range infinity. The same as Imath's half, except for the bits of NaN.
void halvesFrom(const float* from, std::span<std::uint16_t> to);

}  // namespace stx
