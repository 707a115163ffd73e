#include "formats/viewer/page_text.hpp"

#include <algorithm>
#include <cstdint>

#include "formats/files/deflate.hpp"

namespace stx {
namespace {

/// Two digits of these are 31 bits. None of the characters is a mark of direction, a surrogate or
/// anything that HTML reads as more than text.
constexpr std::uint32_t kDigits = 46341, kFirst = 0x2100;
constexpr int kPairBits = 31;
/// Of zlib; what is packed is small.
constexpr int kBestLevel = 12;

void append16(std::string& out, std::uint32_t unit) {
    out += static_cast<char>(unit & 0xff);
    out += static_cast<char>(unit >> 8);
}

void appendPair(std::string& out, std::uint32_t value) {
    append16(out, kFirst + value % kDigits);
    append16(out, kFirst + value / kDigits);
}

bool isWord(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '$' || c == '#' || static_cast<unsigned char>(c) >= 0x80;
}

/// Where a string, template or regular expression that begins at `at` ends.
std::size_t endOfLiteral(std::string_view code, std::size_t at) {
    const char quote = code[at];
    bool inList = false;  // [...] of a regular expression may hold a slash
    std::size_t end = at + 1;
    for (; end < code.size() && (inList || code[end] != quote); ++end) {
        if (code[end] == '\\')
            ++end;
        else if (quote == '/' && (code[end] == '[' || code[end] == ']'))
            inList = code[end] == '[';
    }
    return std::min(end + 1, code.size());
}

/// Whether a slash after this begins a regular expression instead of dividing.
bool startsExpression(std::string_view before) {
    if (before.ends_with("return")) return true;
    return before.empty() ||
           std::string_view("(,=:[!&|?{};\n").find(before.back()) != std::string_view::npos;
}

}  // namespace

std::string utf16Of(std::string_view utf8) {
    std::string out;
    out.reserve(2 * utf8.size());
    for (std::size_t at = 0; at < utf8.size();) {
        const auto lead = static_cast<unsigned char>(utf8[at++]);
        const int more = lead < 0xc0 ? 0 : lead < 0xe0 ? 1 : lead < 0xf0 ? 2 : 3;
        std::uint32_t code = more == 0 ? lead : lead & (0x3fu >> more);
        for (int i = 0; i < more && at < utf8.size(); ++i)
            code = code << 6 | (static_cast<unsigned char>(utf8[at++]) & 0x3fu);
        if (code < 0x10000) {
            append16(out, code);
        } else {
            append16(out, 0xd800 + ((code - 0x10000) >> 10));
            append16(out, 0xdc00 + ((code - 0x10000) & 0x3ff));
        }
    }
    return out;
}

std::string pageText(ByteSpan bytes) {
    std::string out;
    out.reserve((bytes.size() * 8 / kPairBits + 2) * 4);
    appendPair(out, static_cast<std::uint32_t>(bytes.size()));
    std::uint64_t bits = 0;
    int count = 0;
    for (const std::byte byte : bytes) {
        bits |= std::to_integer<std::uint64_t>(byte) << count;
        count += 8;
        if (count < kPairBits) continue;
        appendPair(out, static_cast<std::uint32_t>(bits & ((1ull << kPairBits) - 1)));
        bits >>= kPairBits;
        count -= kPairBits;
    }
    if (count > 0) appendPair(out, static_cast<std::uint32_t>(bits));
    return out;
}

std::string packedPageText(std::string_view text) {
    Bytes packed(zlibBound(text.size()));
    packed.resize(compressZlib(std::as_bytes(std::span(text)), kBestLevel, packed));
    return pageText(packed);
}

std::string withoutComments(std::string_view code) {
    std::string out;
    bool directive = false;  // a line of the preprocessor, where spaces may count
    char before = '\n';      // the last character that is not a space
    for (std::size_t at = 0; at < code.size();) {
        const char c = code[at];
        if (code.substr(at, 2) == "//") {
            at = std::min(code.find('\n', at), code.size());
        } else if (c == '"' || c == '\'' || c == '`' || (c == '/' && startsExpression(out))) {
            const std::size_t end = endOfLiteral(code, at);
            out += code.substr(at, end - at);
            before = c;
            at = end;
        } else if (c == ' ' || c == '\n') {
            const std::size_t end = std::min(code.find_first_not_of(" \n", at), code.size());
            const std::string_view gap = code.substr(at, end - at);
            const char after = end < code.size() ? code[end] : '\n';
            at = end;
            const bool comment = code.substr(end, 2) == "//";
            if (gap.find('\n') != std::string_view::npos || comment) {
                // A comment's own line end comes after it.
                if (!comment && before != '\n') out += before = '\n', directive = false;
            } else if (directive || (isWord(before) && isWord(after)) ||
                       (before == after && (before == '+' || before == '-'))) {
                out += ' ';
            }
        } else {
            directive = directive || (c == '#' && before == '\n');
            out += before = c;
            ++at;
        }
    }
    return out;
}

}  // namespace stx
