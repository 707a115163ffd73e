#pragma once

#include <glm/glm.hpp>

namespace stx::metrics {

inline glm::vec3 over(glm::vec4 straight, glm::vec3 background) {
    return straight.a >= 1.0f ? glm::vec3(straight)
                              : glm::vec3(straight) * straight.a + background * (1.0f - straight.a);
}

/// A pixel as it is seen, laid over the background. 8-bit values are kept as 0..255, so that
/// differences of opaque pixels are whole numbers.
inline glm::vec3 seenPixel(glm::u8vec4 c, glm::vec3 background) {
    if (c.a == 255) return {c.r, c.g, c.b};
    return over(glm::vec4(c.r, c.g, c.b, c.a / 255.0f), background * 255.0f);
}
inline glm::vec3 seenPixel(glm::vec4 c, glm::vec3 background) {
    return over(c, background);
}

}  // namespace stx::metrics
