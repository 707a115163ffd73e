#pragma once

#include <cstdint>

#include "lib/base/image.hpp"

namespace stx {

/// Removes the mixed (flying) pixels of a depth image: those that hang between a near and a far
/// surface, belonging to neither, and those without neighbours. A slanted surface is kept: a pixel
/// goes only when its steps to both sides are large beside the slopes further out.
/// `distances`: kNoDepth = none. Gives the number of pixels that were made none.
std::int64_t dropMixedPixels(Image<float>& distances);

}  // namespace stx
