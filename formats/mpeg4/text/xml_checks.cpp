#include "formats/mpeg4/text/xml_checks.hpp"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <utility>
#include <vector>

namespace stx::mpeg4 {
namespace {

bool isNameChar(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-' || c == '.' || c == ':' || static_cast<unsigned char>(c) >= 0x80;
}

/// `#38` or `#x26`: XML 1.0, production 2.
bool isCharacter(std::string_view digits) {
    digits.remove_prefix(1);
    const bool hex = digits.starts_with('x');
    if (hex) digits.remove_prefix(1);
    std::uint32_t code = 0;
    const auto [end, error] =
        std::from_chars(digits.data(), digits.data() + digits.size(), code, hex ? 16 : 10);
    if (error != std::errc() || end != digits.data() + digits.size()) return false;
    return code == 9 || code == 10 || code == 13 || (code >= 0x20 && code <= 0xd7ff) ||
           (code >= 0xe000 && code <= 0xfffd) || (code >= 0x10000 && code <= 0x10ffff);
}

}  // namespace

std::optional<BadReference> findBadReference(std::string_view xml) {
    constexpr std::pair<std::string_view, std::string_view> kAside[] = {
        {"<!--", "-->"}, {"<![CDATA[", "]]>"}, {"<?", "?>"}};
    for (std::size_t at = 0; (at = xml.find_first_of("<&", at)) != std::string_view::npos;) {
        const auto rest = xml.substr(at);
        if (xml[at] == '<') {
            ++at;
            if (rest.starts_with("<!DOCTYPE")) {  // what it declares stands for nothing here
                const auto inner = xml.find('[', at), end = xml.find('>', at);
                at = inner < end ? xml.find(']', inner) : end;
                if (at == std::string_view::npos) return std::nullopt;
                continue;
            }
            for (const auto& [begin, end] : kAside) {
                if (!rest.starts_with(begin)) continue;
                const auto close = xml.find(end, at);
                if (close == std::string_view::npos) return std::nullopt;
                at = close + end.size();
                break;
            }
            continue;
        }
        std::size_t size = rest.starts_with("&#") ? 2 : 1;
        while (size < rest.size() && isNameChar(rest[size])) ++size;
        // A & without a name and a ; is taken for itself, as many writers mean it.
        const bool reference = size > 1 && size < rest.size() && rest[size] == ';';
        const auto name = rest.substr(1, size - 1);
        const bool known = name == "amp" || name == "lt" || name == "gt" || name == "quot" ||
                           name == "apos" || (name.starts_with('#') && isCharacter(name));
        if (reference && !known) return BadReference{at, std::string(rest.substr(0, size + 1))};
        at += size;
    }
    return std::nullopt;
}

pugi::xml_node findDoubleAttribute(const pugi::xml_document& xml, std::string& name) {
    struct Walker : pugi::xml_tree_walker {
        pugi::xml_node found;
        std::string name;
        std::vector<std::string_view> names;
        bool for_each(pugi::xml_node& node) override {
            names.clear();
            for (const auto attribute : node.attributes()) names.emplace_back(attribute.name());
            std::sort(names.begin(), names.end());
            const auto twice = std::adjacent_find(names.begin(), names.end());
            if (twice == names.end()) return true;
            found = node;
            name = *twice;
            return false;
        }
    } walker;
    pugi::xml_node top = xml;
    top.traverse(walker);
    name = walker.name;
    return walker.found;
}

}  // namespace stx::mpeg4
