#include "formats/images/images.hpp"

namespace stx {

Image<glm::vec4> rgbaFloatFrom(const DecodedImage& image) {
    Image<glm::vec4> out(image.width, image.height);
    const auto channel = [&](const char* name, int fallback) {
        for (int i = 0; i < image.channels; ++i) {
            if (i < static_cast<int>(image.channelNames.size()) && image.channelNames[i] == name)
                return i;
        }
        return fallback;
    };
    const bool grey = image.channels < 3;
    const int r = channel("R", 0), g = channel("G", grey ? 0 : 1), b = channel("B", grey ? 0 : 2);
    const int a = channel("A", -1);
    std::visit(
        [&](const auto& values) {
            using Value = typename std::decay_t<decltype(values)>::value_type;
            constexpr float kScale = std::is_same_v<Value, std::uint8_t>    ? 1.0f / 255.0f
                                     : std::is_same_v<Value, std::uint16_t> ? 1.0f / 65535.0f
                                                                            : 1.0f;
            const auto* p = values.data();
            for (auto& q : out.pixels()) {
                const float alpha = a < 0 ? 1.0f : static_cast<float>(p[a]) * kScale;
                q = glm::vec4(p[r] * kScale, p[g] * kScale, p[b] * kScale, alpha);
                if (image.premultiplied && alpha > 0.0f) q = glm::vec4(glm::vec3(q) / alpha, alpha);
                p += image.channels;
            }
        },
        image.values);
    return out;
}

}  // namespace stx
