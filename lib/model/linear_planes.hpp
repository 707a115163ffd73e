#pragma once

#include <array>
#include <cstddef>

#include <glm/glm.hpp>

namespace stx {

/// Premultiplied linear light of `count` sRGB-coded, premultiplied pixels: all of the red, then
/// green, blue and alpha. Colours are divided by alpha, made linear by linearByTable(), above 1,
/// where light may make them, by linearFromSrgb(), and multiplied again. Pixels without alpha stay
/// as they are.
void linearPlanes(const glm::vec4* pixels, std::size_t count, const std::array<float*, 4>& planes);

}  // namespace stx
