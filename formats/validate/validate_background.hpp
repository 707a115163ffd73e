#pragma once

#include "formats/mpeg4/mapping/stream_images.hpp"
#include "formats/mpeg4/scene/scene_walk.hpp"
#include "formats/validate/findings.hpp"

namespace stx {

/// Rules 8xxx on the Backgrounds of a scene, and 4005 on their pictures. Headers are read, no
/// pixels.
void checkBackgrounds(const std::vector<mpeg4::ShownBackground>& backgrounds,
                      const mpeg4::StreamImages& images, Findings& findings);

}  // namespace stx
