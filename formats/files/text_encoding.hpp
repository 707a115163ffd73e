#pragma once

#include <optional>
#include <string_view>

#include "formats/files/files.hpp"

namespace stx {

/// The text as UTF-8 when it begins with a byte order mark (UTF-8, UTF-16 or UTF-32 of either byte
/// order), the mark removed; nothing when it has none. Broken surrogates become U+FFFD.
[[nodiscard]] std::optional<Bytes> utf8FromMarked(ByteSpan text);

/// The same of text in ISO-8859-1.
[[nodiscard]] Bytes utf8FromLatin1(ByteSpan text);

/// Without the blanks of ASCII at both ends.
[[nodiscard]] std::string_view trimmed(std::string_view text);

/// Takes the first word off a text; empty at its end. The rest is trimmed.
std::string_view takeWord(std::string_view& text);

[[nodiscard]] inline std::string_view textOf(ByteSpan bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// What is between the words of a line.
[[nodiscard]] constexpr bool isBlank(char c) {
    return c == ' ' || c == '\t';
}

}  // namespace stx
