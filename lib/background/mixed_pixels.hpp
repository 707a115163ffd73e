#pragma once

#include <cstdint>

#include "lib/background/frame_gauge.hpp"
#include "lib/base/image.hpp"

namespace stx::temporal {

/// Inverse distances; 0 of pixels without a point.
[[nodiscard]] Image<float> inverseOf(const Image<float>& depth);

/// Of the rows [from, to) of a frame with these inverse distances: 1 for pixels within two pixels
/// of a depth edge, whose depth and colour may be mixtures of two surfaces. `step`: scene units
/// between codes of depth, 0 of floats.
[[nodiscard]] Image<std::uint8_t> mixedPixels(const Image<float>& inverse, const DepthNoise& noise,
                                              float step, int from, int to);

}  // namespace stx::temporal
