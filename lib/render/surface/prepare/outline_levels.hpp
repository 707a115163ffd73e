#pragma once

#include <cstdint>

#include "lib/base/image.hpp"
#include "lib/model/texture.hpp"

namespace stx::surface {

/// Where the outline of the object runs between the pixels of a view. The level of a pixel is one
/// half minus the distance of its middle from the outline, outwards, pixels: alpha that goes on
/// below 0 and above 1. On a straight outline bilinear levels are one half; bilinear alpha is
/// between 0.43 and 0.57 there, since it does not know how far beyond a pixel the outline is, nor
/// how it is turned. Where outlines are curved within 3x3 pixels, thin or blurred, a level is the
/// alpha. As bytes: levelByte().
///
/// The outline of a pixel that is covered in part is a line: across it is the gradient of alpha
/// (Youngs 1982, as solvers of flow with volumes of fluid do it), and its place follows from the
/// area that is covered. Unless `findsLines` all levels are the alpha.
[[nodiscard]] Image<std::uint8_t> outlineLevels(const Texture& texture, bool findsLines = true);

}  // namespace stx::surface
