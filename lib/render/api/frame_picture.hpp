#pragma once

#include <optional>

#include "lib/model/texture.hpp"
#include "lib/render/api/frame.hpp"

namespace stx {

/// A background, sRGB-coded 0..1, in the colour space of a frame.
[[nodiscard]] std::optional<glm::vec3> inSpaceOf(const Frame& frame,
                                                 const std::optional<glm::vec3>& background);

/// A premultiplied pixel with the background (of its own space) behind it, which makes it opaque.
[[nodiscard]] inline glm::vec4 over(glm::vec4 p, const std::optional<glm::vec3>& background) {
    if (!background) return p;
    return {glm::vec3(p) + *background * (1.0f - glm::clamp(p.a, 0.0f, 1.0f)), 1.0f};
}

/// 8-bit sRGB with straight alpha of a frame; opaque where a background (sRGB-coded 0..1) is given.
[[nodiscard]] Rgba8Image rgba8From(const Frame& frame,
                                   const std::optional<glm::vec3>& background = {});

}  // namespace stx
