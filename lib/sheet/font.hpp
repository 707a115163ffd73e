#pragma once

#include <array>
#include <cstdint>

namespace stx {

/// One character: 13 rows from the top, bit 7 is the leftmost of 7 pixels.
using Glyph = std::array<std::uint8_t, 13>;

/// Drawn as a box: what the font does not have.
inline constexpr char32_t kNoGlyph = 0xfffd;

/// The glyph of a code point: ASCII and Latin-1; that of kNoGlyph for all others.
[[nodiscard]] const Glyph& glyphOf(char32_t code);

}  // namespace stx
