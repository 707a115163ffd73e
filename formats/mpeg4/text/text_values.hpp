#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace stx::mpeg4 {

/// The spelling of values that BT and XMT-A share. All of it is independent of the locale.

/// Reads all of `text` as a number: an optional sign, decimal digits with an optional point and
/// exponent (`1`, `+1`, `-.5`, `1.`, `6e-3`), hexadecimal integers (`0xFF`), `nan`, `inf`. Nothing
/// when it is something else or too large for the type; what is too small becomes zero.
[[nodiscard]] std::optional<float> floatFromText(std::string_view text);
[[nodiscard]] std::optional<double> doubleFromText(std::string_view text);

/// Reads all of `text` as an integer: decimal with an optional sign, `0x` hexadecimal, or a decimal
/// number without a fraction (`3.0`). Nothing outside of 64 bits.
[[nodiscard]] std::optional<std::int64_t> integerFromText(std::string_view text);
/// The same for SFInt32: -2^31 .. 2^32-1 (the upper half, as in 0xFFFFFFFF, is two's complement).
[[nodiscard]] std::optional<std::int32_t> int32FromText(std::string_view text);

/// TRUE, true, 1 and FALSE, false, 0 in any case of letters.
[[nodiscard]] std::optional<bool> boolFromText(std::string_view text);

/// The object descriptor that a URL names: `10`, `od:10`, `od://10`, `od://od10` (letters in any
/// case). Nothing for all other URLs: `10 ` with a blank is one, and so are ids above 1023.
[[nodiscard]] std::optional<int> odFromUrl(std::string_view url);

/// `text` in quotes for BT and for lists of strings in XMT-A: `"` and `\` get a backslash before.
[[nodiscard]] std::string quotedText(std::string_view text);

/// At most 40 bytes of `text` for a message, control characters replaced.
[[nodiscard]] std::string excerpt(std::string_view text);

}  // namespace stx::mpeg4
