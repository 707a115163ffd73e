#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace stx {

/// A character of UTF-8.
struct CodePoint {
    std::uint32_t value = 0;
    std::size_t bytes = 0;  ///< 0 = no UTF-8
};

/// The code point that begins `text`, which is not empty (RFC 3629: no surrogates, and none in more
/// bytes than it needs).
[[nodiscard]] CodePoint firstCodePoint(std::string_view text);

}  // namespace stx
