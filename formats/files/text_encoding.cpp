#include "formats/files/text_encoding.hpp"

#include <cstdint>

namespace stx {
namespace {

void append(Bytes& out, std::uint32_t code) {
    const auto put = [&](std::uint32_t byte) { out.push_back(static_cast<std::byte>(byte)); };
    if (code > 0x10ffff || (code >= 0xd800 && code < 0xe000)) code = 0xfffd;
    if (code < 0x80) {
        put(code);
    } else if (code < 0x800) {
        put(0xc0 | code >> 6);
        put(0x80 | (code & 0x3f));
    } else if (code < 0x10000) {
        put(0xe0 | code >> 12);
        put(0x80 | (code >> 6 & 0x3f));
        put(0x80 | (code & 0x3f));
    } else {
        put(0xf0 | code >> 18);
        put(0x80 | (code >> 12 & 0x3f));
        put(0x80 | (code >> 6 & 0x3f));
        put(0x80 | (code & 0x3f));
    }
}

std::uint32_t unit(ByteSpan text, std::size_t at, std::size_t size, bool bigEndian) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < size; ++i) {
        const auto byte = std::to_integer<std::uint32_t>(text[at + (bigEndian ? i : size - 1 - i)]);
        value = value << 8 | byte;
    }
    return value;
}

}  // namespace

std::optional<Bytes> utf8FromMarked(ByteSpan text) {
    const auto begins = [&](std::initializer_list<unsigned> mark) {
        if (text.size() < mark.size()) return false;
        std::size_t i = 0;
        for (const auto m : mark) {
            if (std::to_integer<unsigned>(text[i++]) != m) return false;
        }
        return true;
    };
    if (begins({0xef, 0xbb, 0xbf})) return Bytes(text.begin() + 3, text.end());
    const bool is32 = begins({0xff, 0xfe, 0, 0}) || begins({0, 0, 0xfe, 0xff});
    const bool is16 = !is32 && (begins({0xff, 0xfe}) || begins({0xfe, 0xff}));
    if (!is32 && !is16) return std::nullopt;
    const bool bigEndian = begins({0, 0, 0xfe, 0xff}) || begins({0xfe, 0xff});
    const std::size_t size = is32 ? 4 : 2;
    Bytes out;
    out.reserve(text.size());
    for (std::size_t at = size; at + size <= text.size(); at += size) {
        auto code = unit(text, at, size, bigEndian);
        if (is16 && code >= 0xd800 && code < 0xdc00 && at + 4 <= text.size()) {
            const auto low = unit(text, at + 2, 2, bigEndian);
            if (low >= 0xdc00 && low < 0xe000) {
                code = 0x10000 + ((code - 0xd800) << 10) + (low - 0xdc00);
                at += 2;
            }
        }
        append(out, code);
    }
    return out;
}

Bytes utf8FromLatin1(ByteSpan text) {
    Bytes out;
    out.reserve(text.size());
    for (const std::byte byte : text) append(out, std::to_integer<std::uint32_t>(byte));
    return out;
}

std::string_view trimmed(std::string_view text) {
    constexpr std::string_view blanks = " \t\r\n\v\f";
    const auto first = text.find_first_not_of(blanks);
    if (first == std::string_view::npos) return {};
    return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

std::string_view takeWord(std::string_view& text) {
    text = trimmed(text);
    const auto word = text.substr(0, text.find_first_of(" \t"));
    text = trimmed(text.substr(word.size()));
    return word;
}

}  // namespace stx
