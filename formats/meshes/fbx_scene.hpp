#pragma once

#include "formats/files/files.hpp"
#include "formats/meshes/foreign_scene.hpp"
#include "lib/base/job.hpp"

namespace stx {

/// Puts right in `scene`, which Assimp read from the FBX file `bytes`, what it tells wrong or not
/// at all (fbxFacts()), with notes on what is lost: bones whose names are not unique, geometric
/// transforms of skins, what is hidden, textures that clamp or have a full name alone, emission
/// without strength, and the material that it makes up. Errors (invalidInput): all meshes are
/// hidden.
[[nodiscard]] Result<void> completeFbx(ByteSpan bytes, ForeignScene& scene, Job& job);

}  // namespace stx
