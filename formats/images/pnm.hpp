#pragma once

#include "formats/images/images.hpp"

namespace stx {

/// The bytes begin as a picture of netpbm does: P1 to P6, which are .pbm, .pgm and .ppm, as text or
/// bytes.
[[nodiscard]] bool isPnm(ByteSpan bytes);

/// Such a picture, of which the first is taken. Up to a largest value of 255 there are 8 bits, else
/// 16, and values are stretched to all of these. Errors (invalidInput): the header is damaged, a
/// value is above the largest, or pixels are missing; more memory than the limits.
[[nodiscard]] Result<DecodedImage> decodePnm(ByteSpan bytes, const Limits& limits);

}  // namespace stx
