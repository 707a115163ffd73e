#pragma once

#include <string>

namespace stx::tools {

/// "Release, GCC 12.2.0, x86_64": how this program was built.
[[nodiscard]] std::string buildText();
/// What `stx --version` prints: the version, how it was built, and which optional parts are here.
[[nodiscard]] std::string versionText();

}  // namespace stx::tools
