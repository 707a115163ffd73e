#pragma once

#include <cstdint>
#include <string_view>

#include "formats/files/files.hpp"

/// Numbers in bytes that are known to be there.
namespace stx::photos {

[[nodiscard]] inline unsigned byteAt(ByteSpan bytes, std::size_t at) {
    return std::to_integer<unsigned>(bytes[at]);
}

/// Of 1 to 4 bytes.
[[nodiscard]] inline std::uint32_t bigEndian(ByteSpan bytes, std::size_t at, int size) {
    std::uint32_t value = 0;
    for (int i = 0; i < size; ++i)
        value = value << 8 | byteAt(bytes, at + static_cast<std::size_t>(i));
    return value;
}
[[nodiscard]] inline std::uint32_t littleEndian(ByteSpan bytes, std::size_t at, int size) {
    std::uint32_t value = 0;
    for (int i = size - 1; i >= 0; --i)
        value = value << 8 | byteAt(bytes, at + static_cast<std::size_t>(i));
    return value;
}

[[nodiscard]] inline std::string_view textIn(ByteSpan bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}
[[nodiscard]] inline bool beginsWith(ByteSpan bytes, std::string_view text) {
    return textIn(bytes).starts_with(text);
}
[[nodiscard]] inline bool endsWith(ByteSpan bytes, std::string_view text) {
    return textIn(bytes).ends_with(text);
}

}  // namespace stx::photos
