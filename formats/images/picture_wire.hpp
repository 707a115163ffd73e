#pragma once

#include <cstdint>

/// What the decoder of pictures tells before it decodes (Tag::pictureHeader), and then their
/// pixels: rows of width * channels values.
namespace stx::decoders {

struct PictureFacts {
    std::int32_t width = 0, height = 0, channels = 0;
    std::int32_t bits = 0;                  ///< how the values come: 8 and 16 unsigned, 32 float
    std::int32_t originX = 0, originY = 0;  ///< the data window in the display window
    std::int32_t displayWidth = 0, displayHeight = 0;
    std::uint8_t linear = 0;
    std::uint8_t premultiplied = 0;
    std::uint8_t unused[2] = {};
    double storedLargest = 0;  ///< see DecodedImage
};

}  // namespace stx::decoders
