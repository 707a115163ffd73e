#include "lib/base/printable.hpp"

#include <cstdint>

#include <fmt/format.h>

namespace stx {
namespace {

struct CodePoint {
    std::uint32_t value = 0;
    std::size_t bytes = 0;  ///< 0 = no UTF-8
};

/// The code point that begins `text`, which is not empty (RFC 3629: no surrogates, no detours).
CodePoint firstOf(std::string_view text) {
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
    const unsigned lead = byte(0);
    if (lead < 0x80) return {lead, 1};
    const std::size_t bytes = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : 2;
    if (lead < 0xC2 || lead > 0xF4 || text.size() < bytes) return {};
    std::uint32_t value = lead & (0x7Fu >> bytes);
    for (std::size_t i = 1; i < bytes; ++i) {
        if ((byte(i) & 0xC0) != 0x80) return {};
        value = value << 6 | (byte(i) & 0x3F);
    }
    const std::uint32_t least = bytes == 2 ? 0x80 : bytes == 3 ? 0x800 : 0x10000;
    if (value < least || value > 0x10FFFF || (value >= 0xD800 && value <= 0xDFFF)) return {};
    return {value, bytes};
}

bool mayBeShown(std::uint32_t c) {
    if (c < 0x20 || (c >= 0x7F && c < 0xA0)) return false;
    // Separators of lines and paragraphs, embeddings, overrides and isolates of direction.
    return !(c >= 0x2028 && c <= 0x202E) && !(c >= 0x2066 && c <= 0x2069);
}

std::string escaped(std::string_view text, bool keepLines) {
    std::string out;
    out.reserve(text.size());
    while (!text.empty()) {
        const CodePoint c = firstOf(text);
        const std::size_t bytes = c.bytes > 0 ? c.bytes : 1;
        if ((c.bytes > 0 && mayBeShown(c.value)) || (keepLines && text[0] == '\n')) {
            out += text.substr(0, bytes);
        } else if (text[0] == '\n') {
            out += "\\n";
        } else if (text[0] == '\r') {
            out += "\\r";
        } else if (text[0] == '\t') {
            out += "\\t";
        } else {
            for (const char b : text.substr(0, bytes))
                out += fmt::format("\\x{:02x}", static_cast<unsigned char>(b));
        }
        text.remove_prefix(bytes);
    }
    return out;
}

}  // namespace

std::string printable(std::string_view text) {
    return escaped(text, false);
}

std::string printableLines(std::string_view text) {
    return escaped(text, true);
}

}  // namespace stx
