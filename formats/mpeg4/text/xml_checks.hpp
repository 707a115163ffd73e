#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include <pugixml.hpp>

namespace stx::mpeg4 {

// What XML 1.0 forbids and pugixml takes in its own way, without a word.

/// A reference that stands for nothing: a character that XML does not have (`&#0;`, which ends a
/// value for pugixml), an entity that is not declared by XML itself (kept as text).
struct BadReference {
    std::size_t offset = 0;  ///< of its &
    std::string text;
};
/// The first one outside of comments, CDATA and instructions.
[[nodiscard]] std::optional<BadReference> findBadReference(std::string_view xml);

/// The first element in the order of the text that has an attribute twice, of which pugixml gives
/// the first; an empty node when there is none. `name` becomes the attribute's.
[[nodiscard]] pugi::xml_node findDoubleAttribute(const pugi::xml_document& xml, std::string& name);

}  // namespace stx::mpeg4
