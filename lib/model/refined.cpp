
#include <fmt/format.h>

#include "lib/base/whole_number.hpp"
#include "lib/model/reference_view.hpp"

namespace stx {

std::string Refined::text() const {
    return fmt::format("{} {}", steps, doubt);
}

std::optional<Refined> Refined::from(std::string_view text) {
    const auto space = text.find(' ');
    const std::string_view steps = text.substr(0, space);
    if (space == std::string_view::npos || steps.empty() ||
        steps.find_first_not_of("abcdefghijklmnopqrstuvwxyz,") != std::string_view::npos)
        return std::nullopt;
    const auto doubt = wholeNumber<decltype(Refined::doubt)>(text.substr(space + 1));
    if (!doubt || !(*doubt >= 0 && *doubt <= 1)) return std::nullopt;
    return Refined{std::string(steps), *doubt};
}

}  // namespace stx
