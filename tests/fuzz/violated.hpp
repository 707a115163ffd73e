#pragma once

#include <cstdio>
#include <cstdlib>
#include <string>

namespace stx {

/// Ends the process as a crash does: a promise was broken.
[[noreturn]] inline void violated(const char* what, const std::string& detail = {}) {
    std::fprintf(stderr, "violated: %s%s%s\n", what, detail.empty() ? "" : ": ", detail.c_str());
    std::abort();
}

}  // namespace stx
