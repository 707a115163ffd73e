#pragma once

#include "formats/images/images.hpp"
#include "formats/photos/photo.hpp"

namespace stx::photos {

/// Decodes an item of a HEIF file, upright, in a process of its own (formats/decoders): three
/// channels of 8 bits, or one where `grey`. Memory is bounded by the size that the item claims.
/// Errors as decodeImage(); (unsupported) libheif or our module of it is not here.
[[nodiscard]] Result<DecodedImage> decodeHeifItem(const PhotoImage& image, bool grey,
                                                  const Limits& limits);

}  // namespace stx::photos
