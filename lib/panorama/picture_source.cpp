#include "lib/panorama/picture_source.hpp"

#include <algorithm>

#include "lib/model/is_seen.hpp"

namespace stx {

Rgba8Image shownOrNot(Rgba8Image picture) {
    const auto pixels = picture.pixels();
    if (std::all_of(pixels.begin(), pixels.end(), [](glm::u8vec4 p) { return p.a == 255; }))
        return picture;
    for (glm::u8vec4& p : pixels) p.a = isSeen(p) ? 255 : 0;
    Texture texture(std::move(picture));
    bleedColour(texture);
    return std::move(*texture.rgba8());
}

}  // namespace stx
