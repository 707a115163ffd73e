#pragma once

#include <string>
#include <string_view>

#include <fmt/format.h>

namespace stx {

/// "1 view", "3 views": a number with its noun. Another plural than with an s: `several`.
template <class Number>
[[nodiscard]] std::string counted(Number n, std::string_view one, std::string_view several = {}) {
    if (n == 1) return fmt::format("1 {}", one);
    if (!several.empty()) return fmt::format("{} {}", n, several);
    return fmt::format("{} {}s", n, one);
}

}  // namespace stx
