#pragma once

#include <cstdint>
#include <optional>

#include "formats/files/files.hpp"

namespace stx::mpeg4 {

/// What the first bytes of a JPEG or PNG file say, without an image library.
struct ImageHeader {
    std::uint8_t objectTypeIndication = 0;  ///< oti::kJpeg or oti::kPng
    int width = 0;
    int height = 0;
    int components = 0;  ///< channels: 1 grey, 2 grey alpha, 3 RGB, 4 RGBA; palettes count as 3
    int bitDepth = 8;
    int headerLength = 0;  ///< JPEG: where the first marker after the JFIF segment is
    int xDensity = 1;      ///< JPEG
    int yDensity = 1;
};

/// Empty when the bytes are not JPEG or PNG, or end before their size.
[[nodiscard]] std::optional<ImageHeader> readImageHeader(ByteSpan head);

/// The DecoderSpecificInfo of a JPEG stream: headerLength 16, Xdensity 16, Ydensity 16,
/// numComponents 8 (ISO/IEC 14496-1 annex E).
[[nodiscard]] Bytes jpegDecoderSpecificInfo(const ImageHeader& header);

}  // namespace stx::mpeg4
