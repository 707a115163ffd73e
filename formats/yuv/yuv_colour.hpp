#pragma once

#include <cstdint>

namespace stx {

/// The weights of red and blue in Y: MatrixCoefficients of ITU-T H.273, table 4.
enum class YuvMatrix : std::uint8_t {
    bt709,     ///< 1: 0.2126, 0.0722
    bt601,     ///< 5 and 6: 0.299, 0.114
    smpte240,  ///< 7: 0.212, 0.087
    bt2020     ///< 9: 0.2627, 0.0593
};

/// How pictures stored as Y, Cb, Cr become RGB.
struct YuvColour {
    YuvMatrix matrix = YuvMatrix::bt709;
    bool fullRange = false;  ///< 0..255 instead of 16..235 (of 8 bits)
    bool operator==(const YuvColour&) const = default;
};

}  // namespace stx
