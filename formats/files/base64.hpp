#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "formats/files/files.hpp"

namespace stx {

/// Base64 text (RFC 4648, section 4) of bytes, padded with '='.
[[nodiscard]] std::string encodeBase64(ByteSpan bytes);
/// Bytes of base64 text, with or without padding, of the alphabet for URLs too; nothing when it is
/// not base64.
[[nodiscard]] std::optional<Bytes> decodeBase64(std::string_view text);

}  // namespace stx
