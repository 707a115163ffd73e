#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace stx {

/// Half floats of as many values from `from` on, rounded to the nearest, ties to even; beyond their
/// range infinity. The same as Imath's half, except for the bits of NaN.
void halvesFrom(const float* from, std::span<std::uint16_t> to);

/// The same of `count` pixels of three or four values, each value into a plane of its own: value k
/// of pixel i is planes[k][i].
void halfPlanes(const float* from, int values, std::size_t count, std::uint16_t* const* planes);

}  // namespace stx
