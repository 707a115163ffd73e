#include "formats/viewer/page_text.hpp"

#include <algorithm>
#include <cstdint>

#include "formats/files/deflate.hpp"

namespace stx {
namespace {

constexpr std::uint32_t kDigits = 91, kPairBits = 13, kSingleBits = 6;
/// Of zlib; what is packed is small.
constexpr int kBestLevel = 12;

std::string digits() {
    std::string out;
    for (char c = '!'; c <= '~'; ++c) {
        if (c != '"' && c != '&' && c != '<') out += c;
    }
    return out;
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

std::string pageText(ByteSpan bytes) {
    static const std::string kAlphabet = digits();
    std::string out;
    out.reserve(bytes.size() * 8 / kPairBits * 2 + 4);
    std::uint32_t bits = 0, count = 0;
    for (const std::byte byte : bytes) {
        bits |= std::to_integer<std::uint32_t>(byte) << count;
        count += 8;
        if (count < kPairBits) continue;
        const std::uint32_t value = bits & ((1u << kPairBits) - 1);
        out += kAlphabet[value % kDigits];
        out += kAlphabet[value / kDigits];
        bits >>= kPairBits;
        count -= kPairBits;
    }
    if (count > 0) out += kAlphabet[bits % kDigits];
    if (count > kSingleBits) out += kAlphabet[bits / kDigits];
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
