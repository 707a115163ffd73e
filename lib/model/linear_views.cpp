#include "lib/model/linear_views.hpp"

#include <algorithm>

#include "lib/model/srgb8.hpp"

namespace stx {

void makeLinear(ReferenceView& view) {
    const Rgba8Image* coded = view.texture.rgba8();
    if (!coded) return;
    RgbaFloatImage floats(coded->width(), coded->height());
    std::ranges::transform(coded->pixels(), floats.pixels().begin(), [](glm::u8vec4 c) {
        return glm::vec4(linearFromSrgb8(c.r), linearFromSrgb8(c.g), linearFromSrgb8(c.b),
                         static_cast<float>(c.a) / 255.0f);
    });
    view.texture = std::move(floats);
}

}  // namespace stx
