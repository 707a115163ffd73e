#include "formats/exr/exr_colour.hpp"

#include "lib/base/parallel.hpp"
#include "lib/model/srgb8.hpp"

namespace stx {

Image<glm::vec4> premultipliedLinear(const Texture& texture) {
    return premultipliedLinear(texture, 0, texture.height());
}

Image<glm::vec4> premultipliedLinear(const Texture& texture, int top, int rows) {
    Image<glm::vec4> out(texture.width(), rows);
    const Srgb8Tables& t = srgb8Tables();
    parallelFor(0, rows, [&](std::int64_t row) {
        auto to = out.row(static_cast<int>(row));
        const int y = top + static_cast<int>(row);
        if (const auto* image = texture.rgba8()) {
            const auto from = image->row(y);
            for (std::size_t x = 0; x < to.size(); ++x) {
                const auto& p = from[x];
                const float a = static_cast<float>(p.a) / 255.0f;
                to[x] = {t.linear(p.r) * a, t.linear(p.g) * a, t.linear(p.b) * a, a};
            }
        } else {
            const auto from = texture.rgbaFloat()->row(y);
            for (std::size_t x = 0; x < to.size(); ++x)
                to[x] = {glm::vec3(from[x]) * from[x].a, from[x].a};
        }
    });
    return out;
}

Texture textureFromPremultiplied8(const Image<glm::vec4>& premultiplied) {
    Rgba8Image out(premultiplied.width(), premultiplied.height());
    const Srgb8Tables& t = srgb8Tables();
    parallelFor(0, out.height(), [&](std::int64_t row) {
        const auto from = premultiplied.row(static_cast<int>(row));
        const auto to = out.row(static_cast<int>(row));
        for (std::size_t x = 0; x < to.size(); ++x) {
            const auto& p = from[x];
            const int a = p.a >= 1.0f  ? 255
                          : p.a > 0.0f ? static_cast<int>(p.a * 255.0f + 0.5f)
                                       : 0;
            if (a == 0) continue;
            const float inverse = 255.0f / static_cast<float>(a);
            to[x] = {t.code(p.r * inverse), t.code(p.g * inverse), t.code(p.b * inverse), a};
        }
    });
    Texture texture(std::move(out));
    bleedColour(texture);
    return texture;
}

Texture textureFromPremultiplied(const Image<glm::vec4>& premultiplied) {
    RgbaFloatImage out(premultiplied.width(), premultiplied.height());
    parallelFor(0, out.height(), [&](std::int64_t row) {
        const auto from = premultiplied.row(static_cast<int>(row));
        const auto to = out.row(static_cast<int>(row));
        for (std::size_t x = 0; x < to.size(); ++x) {
            const auto& p = from[x];
            if (p.a > 0.0f) to[x] = {glm::vec3(p) / p.a, p.a};
        }
    });
    Texture texture(std::move(out));
    bleedColour(texture);
    return texture;
}

}  // namespace stx
