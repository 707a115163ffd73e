#pragma once

#include <string_view>

#include "lib/base/result.hpp"

/// The tags of a COLLADA file, taken from its text.
namespace stx::collada {

/// Calls visit(at) for each element's start and end; comments are passed over. Errors: of visit.
template <class Visit>
Result<void> eachTag(std::string_view text, const Visit& visit) {
    for (auto at = text.find('<'); at != std::string_view::npos; at = text.find('<', at + 1)) {
        if (text.substr(at).starts_with("<!--")) {
            at = text.find("-->", at);
            if (at == std::string_view::npos) break;
        } else {
            STX_CHECK(visit(at));
        }
    }
    return {};
}

/// The name of the element whose start or end, with '/', `text` begins with.
[[nodiscard]] std::string_view nameOf(std::string_view text);

/// What is between the tags, where `text` begins with an element of this name and nothing else is
/// in it; else empty.
[[nodiscard]] std::string_view contentOf(std::string_view text, std::string_view name);

/// The value of an attribute in the tag that `text` begins with; empty without one.
[[nodiscard]] std::string_view attributeOf(std::string_view text, std::string_view name);

/// Where the tag ends that starts at `at`.
[[nodiscard]] std::size_t endOfTag(std::string_view text, std::size_t at);

/// Where the element ends that starts at `at`; what it has in it is of other names.
[[nodiscard]] std::size_t endOfElement(std::string_view text, std::size_t at);

}  // namespace stx::collada
