#pragma once

#include <memory>
#include <string>

#include "lib/model/sequence.hpp"
#include "lib/refine/refine.hpp"
#include "tools/command_line.hpp"

namespace stx::tools {

/// --refine auto|off|STEPS of commands that draw or write refined views.
Option refineOption(Command& command, std::string& text);

/// Frames whose depth is refined when they are read; a note says which steps were done. `text` is
/// that of the option.
[[nodiscard]] Result<std::unique_ptr<Sequence>> refined(std::unique_ptr<Sequence> frames,
                                                        const std::string& text);

}  // namespace stx::tools
