#pragma once

#include "formats/files/files.hpp"

namespace stx {

/// The PNG or JPEG without what does not change its pixels (text, EXIF, XMP, ICC, dates,
/// thumbnails, bytes behind its end); anything else comes back as it is. Decoders crash on such
/// extras and print about them, and encoders add their name and the time. Error (invalidInput) with
/// the byte, when a chunk or segment runs past the end or a PNG chunk fails its checksum.
[[nodiscard]] Result<Bytes> stripMetadata(ByteSpan bytes);

}  // namespace stx
