#include "lib/base/printable.hpp"

#include <fmt/format.h>

#include "lib/base/code_point.hpp"

namespace stx {
namespace {

bool mayBeShown(std::uint32_t c) {
    if (c < 0x20 || (c >= 0x7F && c < 0xA0)) return false;
    // Separators of lines and paragraphs, embeddings, overrides and isolates of direction.
    return !(c >= 0x2028 && c <= 0x202E) && !(c >= 0x2066 && c <= 0x2069);
}

std::string escaped(std::string_view text, bool keepLines) {
    std::string out;
    out.reserve(text.size());
    while (!text.empty()) {
        const CodePoint c = firstCodePoint(text);
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

std::string xmlText(std::string_view text) {
    std::string out;
    for (const char c : printable(text)) {
        if (c == '<')
            out += "&lt;";
        else if (c == '>')
            out += "&gt;";
        else if (c == '&')
            out += "&amp;";
        else
            out += c;
    }
    return out;
}

}  // namespace stx
