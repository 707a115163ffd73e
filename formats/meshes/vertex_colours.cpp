#include "formats/meshes/vertex_colours.hpp"

#include <algorithm>
#include <cmath>

#include "lib/model/texture.hpp"

namespace stx {

void linearFromSrgbColours(std::vector<glm::vec4>& colours, bool mayBeBytes) {
    bool bytes = false;
    for (const auto& c : colours) bytes = bytes || c.r > 1.0f || c.g > 1.0f || c.b > 1.0f;
    const float scale = bytes && mayBeBytes ? 1.0f / 255.0f : 1.0f;
    float largestAlpha = 0;
    for (const auto& c : colours) largestAlpha = std::max(largestAlpha, c.a);
    const float alphaScale = scale != 1.0f && largestAlpha > 1.0f ? scale : 1.0f;
    for (auto& c : colours) {
        for (int k = 0; k < 3; ++k) {
            // Not-a-numbers stay, so that MeshBuilder sees and says them.
            if (!std::isnan(c[k])) c[k] = linearFromSrgb(c[k] * scale);
        }
        c.a *= alphaScale;
    }
}

}  // namespace stx
