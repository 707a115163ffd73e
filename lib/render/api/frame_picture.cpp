#include "lib/render/api/frame_picture.hpp"

#include "lib/base/parallel.hpp"
#include "lib/model/srgb8.hpp"

namespace stx {
namespace {

std::uint8_t to8(float coded) {
    if (!(coded > 0.0f)) return 0;
    return static_cast<std::uint8_t>(std::min(coded, 1.0f) * 255.0f + 0.5f);
}

}  // namespace

std::optional<glm::vec3> inSpaceOf(const Frame& frame, const std::optional<glm::vec3>& background) {
    if (!background || !frame.linear) return background;
    return glm::vec3(linearFromSrgb(background->r), linearFromSrgb(background->g),
                     linearFromSrgb(background->b));
}

Rgba8Image rgba8From(const Frame& frame, const std::optional<glm::vec3>& background) {
    Rgba8Image out(frame.colour.width(), frame.colour.height());
    const auto behind = inSpaceOf(frame, background);
    const Srgb8Tables& srgb = srgb8Tables();
    parallelFor(0, out.height(), [&](int y) {
        const auto from = frame.colour.row(y);
        const auto to = out.row(y);
        for (std::size_t x = 0; x < to.size(); ++x) {
            glm::vec4 p = over(from[x], behind);
            if (!(p.a > 0.0f)) continue;
            if (p.a != 1.0f) p = {glm::vec3(p) / p.a, p.a};
            if (frame.linear)
                to[x] = {srgb.code(p.r), srgb.code(p.g), srgb.code(p.b), to8(p.a)};
            else
                to[x] = {to8(p.r), to8(p.g), to8(p.b), to8(p.a)};
        }
    });
    return out;
}

}  // namespace stx
