#pragma once

#include "formats/mpeg4/mapping/stream_images.hpp"
#include "formats/validate/findings.hpp"

namespace stx {

/// Rules 7xxx on the pictures in time of one view's textures (`texture` is its SimpleTexture).
/// Headers of all pictures are read, no pixels.
void checkMovies(const mpeg4::Node& texture, const mpeg4::StreamImages& images,
                 const std::string& where, const Limits& limits, Findings& findings);

}  // namespace stx
