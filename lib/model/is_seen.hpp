#pragma once

#include <glm/glm.hpp>

namespace stx {

/// Whether a pixel with straight alpha shows more of what was photographed than it hides. What was
/// cut out of a picture is not looked at.
[[nodiscard]] inline bool isSeen(glm::u8vec4 pixel) {
    return pixel.a >= 128;
}

}  // namespace stx
