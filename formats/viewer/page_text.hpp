#pragma once

#include <string>
#include <string_view>

#include "formats/files/files.hpp"

namespace stx {

/// Bytes as text for a script element of HTML: 13 bits, the lowest of the bytes first, are two of
/// the 91 printable characters of ASCII that are not space, '"', '&' or '<', the lower digit first;
/// up to 6 bits at the end are one character. 1.23 characters a byte, where base64 has 1.33. All of
/// ASCII that a script element keeps, control characters and all, would take 1.15. Bytes above 127
/// would take 1.02 as windows-1252, but servers that say UTF-8 overrule what the page says.
/// unpack.js reads it.
[[nodiscard]] std::string pageText(ByteSpan bytes);

/// Text packed by zlib, as pageText().
[[nodiscard]] std::string packedPageText(std::string_view text);

/// A program with what only people need left out: comments, empty lines, indentation and spaces
/// beside signs. For JavaScript and GLSL; strings, templates, regular expressions and lines of the
/// preprocessor keep their spaces, and lines stay lines. Written for the viewer's own files, not
/// for all that the languages allow.
[[nodiscard]] std::string withoutComments(std::string_view code);

}  // namespace stx
