#pragma once

#include <string>
#include <vector>

#include "lib/base/job.hpp"

namespace stx {

/// What of stx a machine has: each part that may be missing is a row of the table in parts.cpp.
enum class PartState {
    here,      ///< it works, as far as was looked
    missing,   ///< it is built in, but what it needs is not on this machine
    notBuilt,  ///< this build was made without it
};
/// "ok", "missing", "not built".
[[nodiscard]] const char* nameOf(PartState state);

struct Part {
    std::string name;      ///< "image codecs"
    std::string use;       ///< what it is for: "TIFF, WebP and most other pictures"
    std::string packages;  ///< Debian packages that bring it, as text for people; may be empty
    bool needed = false;   ///< an installation without it is not whole
    PartState state = PartState::here;
    std::string detail;  ///< where or what it is, or why it is missing
};

/// How closely to look.
enum class PartCheck {
    quick,  ///< at names of files only, within a millisecond
    whole,  ///< libraries are loaded and devices asked: up to a second
};

/// All parts, in the order of the table; a quick look is at those only that `stx --version` tells.
[[nodiscard]] std::vector<Part> findParts(PartCheck check, Job& job);

}  // namespace stx
