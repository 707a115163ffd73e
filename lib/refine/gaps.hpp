#pragma once

#include <cstdint>

#include "lib/base/image.hpp"
#include "lib/model/texture.hpp"

namespace stx {

/// Gives pixels without depth, which stereo leaves beside edges and on plain surfaces, that of the
/// surface around them whose colours lead there: each goes to the known pixel from which the path
/// over neighbours crosses the least change of colour. The plane that fits the surface there is
/// continued. Gaps are closed up to a fiftieth of the picture's longer side from known pixels, and
/// not beyond edges of the picture; the rest stays unknown, and known pixels stay as they are.
///
/// `distances`: scene units, kNoDepth = unknown; `texture` has the same size. Pixels with alpha
/// below 1 stay unknown. Gives the number of pixels that became known. One thread.
std::int64_t closeDepthGaps(Image<float>& distances, const Texture& texture);

}  // namespace stx
