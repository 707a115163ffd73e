#pragma once

#include <string>
#include <string_view>

namespace stx {

/// Text from anywhere (names inside files, messages of libraries) as one line that is safe to show
/// on a terminal: control characters (C0, DEL, C1), line and paragraph separators, marks that turn
/// the direction of writing, and bytes that are not UTF-8 become `\n`, `\t`, `\r` or `\x1b` for
/// each of their bytes. All else stays as it is, a backslash, too: the result is for reading, not
/// for parsing. Never fails; the result is valid UTF-8.
[[nodiscard]] std::string printable(std::string_view text);

/// The same for text of several lines: ends of lines stay.
[[nodiscard]] std::string printableLines(std::string_view text);

/// printable() text in an element of XML.
[[nodiscard]] std::string xmlText(std::string_view text);

}  // namespace stx
