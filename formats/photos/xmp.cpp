#include "formats/photos/xmp.hpp"

#include <algorithm>

#include "formats/files/text_numbers.hpp"

namespace stx::photos {
namespace {

/// A photo's packet has some hundred elements; each takes 64 bytes and more when it is parsed.
constexpr std::ptrdiff_t kMostNodes = 200'000;

/// The next node in the order of the text; null behind the last.
pugi::xml_node after(pugi::xml_node node) {
    if (const auto child = node.first_child()) return child;
    while (node && !node.next_sibling()) node = node.parent();
    return node ? node.next_sibling() : node;
}

}  // namespace

Result<Xmp> Xmp::parse(ByteSpan packet) {
    const std::string_view text(reinterpret_cast<const char*>(packet.data()), packet.size());
    if (std::ranges::count_if(text, [](char c) { return c == '<' || c == '='; }) > kMostNodes)
        return fail(ErrorCode::invalidInput,
                    "its XMP has more than {} elements and attributes, which no photo's has",
                    kMostNodes);
    Xmp xmp;
    xmp.document_ = std::make_unique<pugi::xml_document>();
    const auto parsed = xmp.document_->load_buffer(packet.data(), packet.size(),
                                                   pugi::parse_default, pugi::encoding_utf8);
    if (!parsed)
        return fail(ErrorCode::invalidInput, "its XMP is not XML: {} at byte {} of it",
                    parsed.description(), parsed.offset);
    for (auto node = xmp.document_->first_child(); node; node = after(node))
        for (const pugi::xml_attribute attribute : node.attributes()) {
            const std::string_view name = attribute.name();
            if (!name.starts_with("xmlns:")) continue;
            std::pair<std::string, std::string> prefix(attribute.value(), name.substr(6));
            if (std::ranges::find(xmp.prefixes_, prefix) == xmp.prefixes_.end())
                xmp.prefixes_.push_back(std::move(prefix));
            constexpr std::size_t kMostPrefixes = 256;
            if (xmp.prefixes_.size() > kMostPrefixes)
                return fail(ErrorCode::invalidInput, "its XMP has more than {} namespaces",
                            kMostPrefixes);
        }
    return xmp;
}

bool Xmp::is(const char* qualified, std::string_view space, std::string_view name) const {
    const std::string_view whole = qualified;
    if (!whole.ends_with(name) || whole.size() <= name.size()) return false;
    const std::size_t colon = whole.size() - name.size() - 1;
    if (whole[colon] != ':') return false;
    return std::ranges::any_of(prefixes_, [&](const auto& known) {
        return known.first == space && known.second == whole.substr(0, colon);
    });
}

std::optional<std::string_view> Xmp::textIn(pugi::xml_node node, std::string_view space,
                                            std::string_view name) const {
    for (const pugi::xml_attribute attribute : node.attributes())
        if (is(attribute.name(), space, name)) return attribute.value();
    for (const pugi::xml_node child : node.children())
        if (is(child.name(), space, name)) return child.text().get();
    return {};
}

std::optional<std::string_view> Xmp::text(std::string_view space, std::string_view name) const {
    for (auto node = document_->first_child(); node; node = after(node))
        if (const auto found = textIn(node, space, name)) return found;
    return {};
}

std::optional<double> Xmp::number(std::string_view space, std::string_view name) const {
    const auto found = text(space, name);
    const auto numbers = found ? numbersFrom(*found) : std::nullopt;
    return numbers && numbers->size() == 1 ? std::optional(numbers->front()) : std::nullopt;
}

std::vector<double> Xmp::numbers(std::string_view space, std::string_view name) const {
    std::vector<double> out;
    const auto found = all(space, name);
    if (found.empty()) return out;
    for (const pugi::xml_node item : found.front().first_child().children()) {
        const auto number = numbersFrom(item.text().get());
        if (!number || number->size() != 1) return {};
        out.push_back(number->front());
    }
    return out;
}

std::vector<pugi::xml_node> Xmp::all(std::string_view space, std::string_view name) const {
    std::vector<pugi::xml_node> found;
    for (auto node = document_->first_child(); node; node = after(node))
        if (is(node.name(), space, name)) found.push_back(node);
    return found;
}

}  // namespace stx::photos
