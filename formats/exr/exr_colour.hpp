#pragma once

#include <glm/glm.hpp>

#include "lib/base/image.hpp"
#include "lib/model/texture.hpp"

namespace stx {

/// Premultiplied linear light of a texture, as OpenEXR files hold colour.
[[nodiscard]] Image<glm::vec4> premultipliedLinear(const Texture& texture);
/// The same of `rows` rows from `y` on.
[[nodiscard]] Image<glm::vec4> premultipliedLinear(const Texture& texture, int y, int rows);
/// The inverse for 8-bit sRGB: exact even when the values went through half floats (alpha is
/// rounded to its 8 bits first, and the steps of sRGB are 4 times coarser than a half's). Colours
/// under alpha 0 are bled.
[[nodiscard]] Texture textureFromPremultiplied8(const Image<glm::vec4>& premultiplied);
/// The inverse for linear floats: exact where alpha is 1, else to the last bit but one.
[[nodiscard]] Texture textureFromPremultiplied(const Image<glm::vec4>& premultiplied);

}  // namespace stx
