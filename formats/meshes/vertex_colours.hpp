#pragma once

#include <vector>

#include <glm/glm.hpp>

namespace stx {

/// Vertex colours of a file that does not say what they mean (PLY, OBJ, STL, .drc) made linear:
/// they are taken as sRGB. `mayBeBytes`: floats above 1 mean that the range is 0..255.
void linearFromSrgbColours(std::vector<glm::vec4>& colours, bool mayBeBytes);

}  // namespace stx
