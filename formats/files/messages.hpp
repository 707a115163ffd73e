#pragma once

#include <string>
#include <string_view>

#include <fmt/format.h>

namespace stx {

/// A file's name for a message.
[[nodiscard]] inline std::string inQuotes(std::string_view name) {
    return fmt::format("'{}'", name);
}

}  // namespace stx
