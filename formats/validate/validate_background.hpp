#pragma once

#include "formats/mpeg4/scene/scene_walk.hpp"
#include "formats/validate/validate_pictures.hpp"

namespace stx {

/// Rules 8xxx on the Backgrounds of a scene, and 4005 on their pictures.
void checkBackgrounds(const std::vector<mpeg4::ShownBackground>& backgrounds,
                      const PictureReader& pictures);

}  // namespace stx
