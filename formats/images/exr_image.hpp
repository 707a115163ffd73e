#pragma once

#include <string_view>

#include "formats/images/images.hpp"

namespace stx {

/// The bytes begin as an OpenEXR file does.
[[nodiscard]] bool isExr(ByteSpan bytes);

/// The first part of an OpenEXR file that has colours (or depth, as asked; or else the first) as
/// floats, without OpenImageIO: R G B Y A first, which may be those of a layer, then its other
/// channels by name; integers as they are. Sizes are checked against the limits and the file. Error
/// (invalidInput), too: more than two channels and no colours, where these are asked for.
[[nodiscard]] Result<DecodedImage> decodeExr(ByteSpan bytes, std::string_view name,
                                             const Limits& limits, bool depth = false);

}  // namespace stx
