#pragma once

#include <cstdint>

#include "lib/base/image.hpp"
#include "lib/model/texture.hpp"

namespace stx {

/// Moves the depth edges of measured depth images, which lie a pixel or two beside those of the
/// picture, to where the colours have them: a pixel of the surface behind whose colour is (mostly)
/// that of the surface in front gets the depth of the latter. Without that it would stay behind as
/// a ghost of the outline in every novel view. A surface's colour is that of its pixels within four
/// pixels that are not at an edge themselves; where there are none, or both surfaces look the same,
/// nothing is moved. Up to two pixels; no unknown pixel becomes known.
///
/// `distances`: scene units, kNoDepth = unknown; `texture` has the same size. Gives the number of
/// pixels changed. The same on any number of threads.
std::int64_t alignDepthEdges(Image<float>& distances, const Texture& texture);

}  // namespace stx
