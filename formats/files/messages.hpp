#pragma once

#include <string>
#include <string_view>

#include <fmt/format.h>

#include "lib/base/result.hpp"

namespace stx {

/// A file's name for a message.
[[nodiscard]] inline std::string inQuotes(std::string_view name) {
    return fmt::format("'{}'", name);
}

/// The same result, its error reported from `where`.
template <class T>
[[nodiscard]] Result<T> within(const std::string& where, Result<T> result) {
    if (!result) return tl::unexpected<Error>(result.error().at(where));
    return result;
}

}  // namespace stx
