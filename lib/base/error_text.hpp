#pragma once

#include <string>

#include "lib/base/result.hpp"

namespace stx {

/// Error::text() with each file named once: what knows a file's name says it, and so does its
/// caller.
[[nodiscard]] std::string textNamingOnce(const Error& error);

}  // namespace stx
