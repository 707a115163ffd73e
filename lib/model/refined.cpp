#include <charconv>

#include <fmt/format.h>

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
    Refined refined{std::string(steps), 0};
    const char* end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data() + space + 1, end, refined.doubt);
    if (error != std::errc() || stop != end || !(refined.doubt >= 0 && refined.doubt <= 1))
        return std::nullopt;
    return refined;
}

}  // namespace stx
