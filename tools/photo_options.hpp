#pragma once

#include "formats/imagesets/image_sets.hpp"
#include "tools/commands.hpp"

namespace stx::tools {

/// --depth-near and --colour-of.
void addPhotoOptions(Command command, PhotoSetOptions& options);
/// --behind, of what is written and not only looked at: without it what is hidden is invented.
void addBehindOption(Command command, PhotoSetOptions& options);

}  // namespace stx::tools
