#pragma once

#include <string_view>

#include "formats/files/files.hpp"
#include "lib/base/job.hpp"

namespace stx {

/// Whether a TIFF, GIF, WebP or PNG has a second picture: a page or a frame, of full size. Decoders
/// here give the first.
[[nodiscard]] bool holdsMorePictures(ByteSpan file);

/// Notes, once for a name, that a file holds more pictures than the one that is taken.
void noteMorePictures(ByteSpan file, std::string_view name, Job& job);

}  // namespace stx
