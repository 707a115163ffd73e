#include "formats/meshes/alpha_map.hpp"

#include <algorithm>
#include <string_view>

#include "lib/capture/material_sampler.hpp"

namespace stx {

int textureWithAlpha(std::vector<MeshTexture>& textures, int base, int alpha, char channel) {
    constexpr std::string_view kChannels = "rgbm";
    const auto plain = kChannels.find(channel);
    const auto& map = textures[alpha];
    const auto& texels = map.pixels.pixels();
    const bool ownAlpha =
        std::any_of(texels.begin(), texels.end(), [](const glm::u8vec4& c) { return c.a != 255; });
    MeshTexture out = base >= 0 ? textures[base] : map;
    const glm::vec2 size(out.pixels.width(), out.pixels.height());
    glm::vec2 middle(0.5f);
    for (auto& pixel : out.pixels.pixels()) {
        const auto c = sampleTexture(map, middle / size);
        // Rec. 709 weights of the coded values: an alpha map is data, not light.
        const float grey = 0.2126f * c.r + 0.7152f * c.g + 0.0722f * c.b;
        const float value = plain < kChannels.size()     ? c[static_cast<int>(plain)]
                            : ownAlpha && channel != 'l' ? c.a
                                                         : grey;
        if (base < 0) pixel = glm::u8vec4(255);
        pixel.a = static_cast<std::uint8_t>(std::clamp(value, 0.0f, 1.0f) * 255.0f + 0.5f);
        if (++middle.x > size.x) middle = {0.5f, middle.y + 1};
    }
    textures.push_back(std::move(out));
    return static_cast<int>(textures.size()) - 1;
}

}  // namespace stx
