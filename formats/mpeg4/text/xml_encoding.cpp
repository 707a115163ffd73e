#include "formats/mpeg4/text/xml_encoding.hpp"

#include <algorithm>
#include <array>
#include <span>

#include "formats/files/no_case.hpp"
#include "formats/files/text_encoding.hpp"
#include "formats/mpeg4/text/text_values.hpp"
#include "formats/mpeg4/text/xmt_lines.hpp"
#include "lib/base/code_point.hpp"

namespace stx::mpeg4 {
namespace {

/// NAME of `<?xml version="1.0" encoding="NAME"?>`; empty where that is missing.
std::string_view declaredEncoding(std::string_view xml) {
    if (!xml.starts_with("<?xml")) return {};
    const auto head = xml.substr(0, xml.find("?>"));
    const auto open = head.find_first_of("\"'", head.find("encoding"));
    if (open == std::string_view::npos) return {};
    return head.substr(open + 1, head.find(head[open], open + 1) - open - 1);
}

bool isOneOf(std::string_view name, std::span<const std::string_view> names) {
    return std::ranges::any_of(names, [&](auto known) { return equalNoCase(name, known); });
}

/// The first byte that does not begin a character of UTF-8; npos when all do.
std::size_t findBadUtf8(std::string_view text) {
    for (std::size_t at = 0; at < text.size();) {
        const auto bytes = firstCodePoint(text.substr(at)).bytes;
        if (bytes == 0) return at;
        at += bytes;
    }
    return std::string_view::npos;
}

}  // namespace

Result<std::optional<std::string>> utf8FromXml(std::string_view xml, const std::string& fileName) {
    constexpr std::array<std::string_view, 4> kUtf8 = {"", "UTF-8", "UTF8", "US-ASCII"};
    constexpr std::array<std::string_view, 2> kLatin1 = {"ISO-8859-1", "latin1"};
    std::optional<std::string> utf8;
    if (const auto marked = utf8FromMarked(std::as_bytes(std::span(xml)))) {
        utf8 = textOf(*marked);
    } else {
        const auto declared = declaredEncoding(xml);
        if (isOneOf(declared, kLatin1))
            utf8 = textOf(utf8FromLatin1(std::as_bytes(std::span(xml))));
        else if (!isOneOf(declared, kUtf8))
            return failAt(fmt::format("'{}':1", fileName), ErrorCode::unsupported,
                          "the encoding is '{0}', and UTF-8, ISO-8859-1, and UTF-16 with a byte "
                          "order mark are read; make it UTF-8: iconv -f {0} -t UTF-8, and "
                          "encoding=\"UTF-8\" in its first line",
                          excerpt(declared));
    }
    const std::string_view text = utf8 ? std::string_view(*utf8) : xml;
    if (const auto bad = findBadUtf8(text); bad != std::string_view::npos)
        return failAt(
            Lines(text).at(fileName, static_cast<std::ptrdiff_t>(bad)), ErrorCode::invalidInput,
            "found the byte {:02X}, which is not UTF-8, and no other encoding is declared; "
            "where the text is ISO-8859-1, its first line must be <?xml "
            "version=\"1.0\" encoding=\"ISO-8859-1\"?>",
            static_cast<unsigned char>(text[bad]));
    return utf8;
}

}  // namespace stx::mpeg4
