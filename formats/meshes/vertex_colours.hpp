#pragma once

#include <vector>

#include <glm/glm.hpp>

namespace stx {

/// Of what no colour is said in a file: linear; 188 of 255 as sRGB.
inline constexpr float kPlainGrey = 0.5f;

/// Vertex colours of a file that does not say what they mean (PLY, OBJ, STL, .drc) made linear:
/// they are taken as sRGB. `mayBeBytes`: floats above 1 mean that the range is 0..255.
void linearFromSrgbColours(std::vector<glm::vec4>& colours, bool mayBeBytes);

}  // namespace stx
