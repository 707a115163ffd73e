#include "formats/meshes/vertex_colours.hpp"

#include <algorithm>
#include <cmath>

#include "lib/model/texture.hpp"

namespace stx {

void ColourRange::add(glm::vec3 colour) {
    for (int k = 0; k < 3; ++k) {
        if (!std::isfinite(colour[k])) continue;
        largest_ = std::max(largest_, colour[k]);
        whole_ = whole_ && colour[k] == std::floor(colour[k]);
    }
}

bool ColourRange::isBytes() const {
    // Colours of 0..1 are a little above 1 where they were rounded or sharpened, and some times as
    // bright as white where they are light. Bytes that are dark throughout are whole.
    constexpr float kBrightestLight = 16;
    return largest_ > (whole_ ? 1.0f : kBrightestLight);
}

void linearFromSrgbColours(std::vector<glm::vec4>& colours, bool mayBeBytes) {
    ColourRange range;
    for (const auto& c : colours) range.add(glm::vec3(c));
    const float scale = mayBeBytes && range.isBytes() ? 1.0f / 255.0f : 1.0f;
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
