#include "formats/images/oiio/bmp.hpp"

#include <algorithm>
#include <bit>

#include "formats/images/oiio/failed.hpp"

namespace stx::codecs {
namespace {

/// 0 past the end.
std::uint32_t numberAt(std::span<const std::byte> file, std::size_t at, std::size_t bytes) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < bytes && at + i < file.size(); ++i)
        value |= std::to_integer<std::uint32_t>(file[at + i]) << (8 * i);
    return value;
}

}  // namespace

void BmpPixel::take(std::span<const std::uint8_t> pixels, std::uint8_t* to) const {
    for (std::size_t i = 0; i + 4 <= pixels.size(); i += 4) {
        for (int c = 0; c < channels; ++c) *to++ = pixels[i + static_cast<std::size_t>(from[c])];
    }
}

BmpPixel bmpPixelOf(std::span<const std::byte> file) {
    constexpr std::size_t kHeader = 14;  // of the file; then the size of the second one
    constexpr std::uint32_t kInfo = 40, kWithAlpha = 56, kPlain = 0, kMasks = 3, kFourMasks = 6;
    const std::uint32_t size = numberAt(file, kHeader, 4);
    if (size < kInfo || numberAt(file, 28, 2) != 32) return {};
    const std::uint32_t compression = numberAt(file, 30, 4);
    if (compression == kPlain) return {3, {0, 1, 2, 0}};
    if (compression != kMasks && compression != kFourMasks) return {};
    BmpPixel pixel{3, {}};
    for (std::size_t c = 0; c < 4; ++c) {
        if (c == 3 && size < kWithAlpha && compression != kFourMasks) break;
        const std::uint32_t mask = numberAt(file, 54 + 4 * c, 4);
        if (c == 3 && mask == 0) break;
        const int shift = mask ? std::countr_zero(mask) : 1;
        if (shift % 8 != 0 || mask >> shift != 0xff)
            throw Failed{ErrorCode::unsupported,
                         "the BMP keeps its colours in parts of bytes, which is not supported"};
        constexpr std::array kGiven = {2, 1, 0, 3};  // the bytes of a pixel are B, G, R, A to it
        pixel.from[c] = kGiven[static_cast<std::size_t>(shift) / 8];
        pixel.channels = static_cast<int>(std::max<std::size_t>(c + 1, 3));
    }
    return pixel;
}

}  // namespace stx::codecs
