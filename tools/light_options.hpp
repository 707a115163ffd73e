#pragma once

#include <string>

#include "lib/light/lighting.hpp"

namespace stx::tools {

/// "0.2" or "r,g,b". Errors (usage) name the option.
[[nodiscard]] Result<glm::vec3> parseGreyOrRgb(const std::string& text, const char* option);
/// dir:X,Y,Z[,r,g,b] or point:X,Y,Z[,r,g,b], with a trailing @camera for camera space. A point in
/// the world comes back counted from `origin`. Errors (usage).
[[nodiscard]] Result<Light> parseLight(const std::string& text, glm::dvec3 origin);

}  // namespace stx::tools
