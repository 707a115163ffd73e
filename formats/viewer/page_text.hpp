#pragma once

#include <string>
#include <string_view>

#include "formats/files/files.hpp"

namespace stx {

/// What a page begins with: the mark of UTF-16, lowest byte first. Browsers follow it whatever a
/// server says of the page (Encoding Standard, "decode").
inline constexpr std::string_view kUtf16Mark = "\xff\xfe";

/// Valid UTF-8 in UTF-16, without the mark.
[[nodiscard]] std::string utf16Of(std::string_view utf8);

/// Bytes as text for a script element of HTML in UTF-16: two characters from U+2100 to U+D604, the
/// lower digit first, are 31 bits, the lowest of the bytes first. The first two are the number of
/// bytes, of which there are less than 2^31. 1.03 bytes a byte, where base64 has 1.33; the best
/// that a page in UTF-8 can do is 1.15. unpack.js reads it.
[[nodiscard]] std::string pageText(ByteSpan bytes);

/// Text packed by zlib, as pageText().
[[nodiscard]] std::string packedPageText(std::string_view text);

/// A program with what only people need left out: comments, empty lines, indentation and spaces
/// beside signs. For JavaScript and GLSL; strings, templates, regular expressions and lines of the
/// preprocessor keep their spaces, and lines stay lines. Written for the viewer's own files, not
/// for all that the languages allow.
[[nodiscard]] std::string withoutComments(std::string_view code);

}  // namespace stx
