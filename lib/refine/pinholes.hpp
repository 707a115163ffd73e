#pragma once

#include <cstdint>

#include "lib/base/image.hpp"
#include "lib/geometry/pixel_space.hpp"

namespace stx {

/// Gives single pixels that a sensor missed (full cover, no depth) the depth of the surface around
/// them, when all of their neighbours are on one. `noise` is depthNoise(),
/// `covered`: 1 = full alpha. Gives how many.
std::int64_t closeMissedPixels(Image<float>& q, const Image<std::uint8_t>& covered,
                               const DepthAxis& axis, float noise);

}  // namespace stx
