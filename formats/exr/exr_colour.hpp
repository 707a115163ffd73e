#pragma once

#include <glm/glm.hpp>

#include "formats/exr/exr_file.hpp"
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

/// The colour of a part (R, G, B or Y; A, or covered everywhere) by the one of these that `linear`
/// says, and with it all of `others`, whose values are those of the whole part. Takes little more
/// memory than the texture. Errors: as ExrReader::readPart().
[[nodiscard]] Result<Texture> readTexture(const ExrReader& reader, int part, bool linear,
                                          const std::vector<ExrPixels>& others);

}  // namespace stx
