#pragma once

#include <cstdint>

#include "lib/base/image.hpp"
#include "lib/model/texture.hpp"

namespace stx {

/// 1 for the points inside of translucent surfaces: of an alpha between 0 and 1, with such points
/// all around, which outlines, partly covered, are too narrow for. Both images have one size.
[[nodiscard]] Image<std::uint8_t> translucentInside(const Texture& texture,
                                                    const Image<float>& depth);
/// 1 for the points of translucent surfaces, which surface mode draws opaque: those inside, and
/// those a few pixels around them, over the border. Empty where no point is inside.
[[nodiscard]] Image<std::uint8_t> translucentSurfaces(const Texture& texture,
                                                      const Image<float>& depth);
/// Whether a point is inside of a translucent surface.
[[nodiscard]] bool hasTranslucentInside(const Texture& texture, const Image<float>& depth);

}  // namespace stx
