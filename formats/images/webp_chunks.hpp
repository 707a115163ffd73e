#pragma once

#include <string_view>

#include "formats/files/byte_io.hpp"

namespace stx {

[[nodiscard]] inline bool isWebp(ByteSpan file) {
    return hasText(file, 0, "RIFF") && hasText(file, 8, "WEBP");
}

/// Calls visit(body) for each chunk of a name that is whole, until it says that this is enough
/// (WebP container specification).
template <class Visit>
void eachWebpChunk(ByteSpan file, std::string_view name, const Visit& visit) {
    for (std::size_t at = 12; at + 8 <= file.size();) {
        std::size_t size = 0;
        for (std::size_t i = 4; i-- > 0;)
            size = size << 8 | std::to_integer<std::size_t>(file[at + 4 + i]);
        if (file.size() - at - 8 < size) return;
        if (hasText(file, at, name) && visit(file.subspan(at + 8, size))) return;
        at += 8 + size + size % 2;
    }
}

}  // namespace stx
