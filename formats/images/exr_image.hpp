#pragma once

#include <string_view>

#include "formats/images/images.hpp"

namespace stx {

/// The bytes begin as an OpenEXR file does.
[[nodiscard]] bool isExr(ByteSpan bytes);

/// The first part of an OpenEXR file as floats, without OpenImageIO: R G B A first, then its other
/// channels by name; integers as they are. Sizes are checked against the limits and the file.
[[nodiscard]] Result<DecodedImage> decodeExr(ByteSpan bytes, std::string_view name,
                                             const Limits& limits);

}  // namespace stx
