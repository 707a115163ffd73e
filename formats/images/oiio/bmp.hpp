#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace stx::codecs {

/// What the four bytes of a 32-bit BMP's pixel are. OpenImageIO takes them for blue, green, red and
/// alpha, whatever the file says.
struct BmpPixel {
    int channels = 0;           ///< 3 or 4; 0 = not a BMP of 32 bits
    std::array<int, 4> from{};  ///< where, in what OpenImageIO gives, R, G, B and A are

    /// Gathers the channels of `pixels`, of four bytes each, in `to`.
    void take(std::span<const std::uint8_t> pixels, std::uint8_t* to) const;
};

/// By the masks of the header (BITMAPV4HEADER). Without masks the fourth byte is padding, and alpha
/// is straight. Throws Failed (unsupported) for masks that are not whole bytes.
[[nodiscard]] BmpPixel bmpPixelOf(std::span<const std::byte> file);

}  // namespace stx::codecs
