#include "formats/meshes/collada_tags.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "formats/files/text_encoding.hpp"

namespace stx::collada {

std::string_view nameOf(std::string_view text) {
    return text.substr(1, text.find_first_of("/<> \t\r\n", 2) - 1);
}

std::string_view contentOf(std::string_view text, std::string_view name) {
    if (nameOf(text) != name) return {};
    const auto close = text.find('<', 1);
    if (close == std::string_view::npos) return {};
    const auto open = text.substr(0, close).find('>');
    const auto end = text.substr(close);
    if (open == std::string_view::npos || !end.starts_with("</") || nameOf(end.substr(1)) != name)
        return {};
    return text.substr(open + 1, close - open - 1);
}

std::string_view attributeOf(std::string_view text, std::string_view name) {
    const auto tag = text.substr(0, text.find_first_of("<>", 1));
    const auto fromWord = [](std::string_view rest) {
        return rest.substr(std::min(rest.find_first_not_of(" \t\r\n"), rest.size()));
    };
    for (auto at = tag.find(name); at != std::string_view::npos; at = tag.find(name, at + 1)) {
        const auto value = fromWord(tag.substr(at + name.size()));
        if (trimmed(tag.substr(at - 1, 1)).empty() && value.starts_with('=')) {
            const auto quoted = fromWord(value.substr(1));
            if (quoted.empty()) return {};
            return quoted.substr(1, quoted.find(quoted[0], 1) - 1);
        }
    }
    return {};
}

std::size_t endOfTag(std::string_view text, std::size_t at) {
    return std::min(text.find('>', at), text.size() - 1) + 1;
}

std::size_t endOfElement(std::string_view text, std::size_t at) {
    const auto inside = endOfTag(text, at);
    if (text.substr(0, inside).ends_with("/>")) return inside;
    return endOfTag(text, text.find(fmt::format("</{}", nameOf(text.substr(at))), inside));
}

}  // namespace stx::collada
