#pragma once

#include "formats/imagesets/image_sets.hpp"
#include "tools/commands.hpp"

namespace stx::tools {

/// --depth-near and --colour-of, under a heading of the help.
void addPhotoOptions(const Command& command, PhotoSetOptions& options, const char* heading);
/// --behind, of what is written and not only looked at: without it what is hidden is invented.
void addBehindOption(const Command& command, PhotoSetOptions& options, const char* heading);

}  // namespace stx::tools
