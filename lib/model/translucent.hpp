#pragma once

#include <cstdint>

#include "lib/base/image.hpp"
#include "lib/model/texture.hpp"

namespace stx {

/// 1 for the points inside of translucent surfaces: of an alpha between 0 and 1, with such points
/// all around, which outlines, partly covered, are too narrow for. Both images have one size.
[[nodiscard]] Image<std::uint8_t> translucentInside(const Texture& texture,
                                                    const Image<float>& depth);
/// Whether there is one.
[[nodiscard]] bool hasTranslucentInside(const Texture& texture, const Image<float>& depth);

}  // namespace stx
