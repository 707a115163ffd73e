#pragma once

#include "formats/images/images.hpp"

namespace stx {

/// The bytes begin as an array of NumPy does (.npy), or as a zip archive of them (.npz).
[[nodiscard]] bool isNumpy(ByteSpan bytes);

/// An array of NumPy as a picture: shapes (height, width) and (height, width, channels of 1 to 4),
/// also with ones in front, in either order of memory. uint8 and bool have 8 bits, uint16 has 16;
/// other integers 16 where all of their values fit; float16, float32 and float64 are floats. Of an
/// archive: its only array, or the only one named depth, image, rgb, color, colour or arr_0. Floats
/// are linear, as in OpenEXR. Errors (invalidInput): another type or shape, a damaged header, less
/// bytes than the shape needs, an archive with several arrays; more memory than the limits.
[[nodiscard]] Result<DecodedImage> decodeNumpy(ByteSpan bytes, const Limits& limits);

/// An .npy file (version 1.0) of float32, shape (height, width).
[[nodiscard]] Bytes encodeNumpy(const Image<float>& values);

}  // namespace stx
