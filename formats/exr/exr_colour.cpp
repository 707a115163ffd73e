#include "formats/exr/exr_colour.hpp"

#include <array>
#include <cmath>

#include "lib/base/parallel.hpp"

namespace stx {

namespace {

struct SrgbTables {
    static constexpr int kSlots = 4096;
    std::array<float, 256> linear{};
    std::array<float, 257> lower{};  ///< where the nearest code becomes this one
    std::array<std::uint8_t, kSlots> guess{};

    SrgbTables() {
        const auto exact = [](double coded) {
            return coded <= 0.04045 ? coded / 12.92 : std::pow((coded + 0.055) / 1.055, 2.4);
        };
        for (int i = 0; i < 256; ++i) {
            linear[i] = static_cast<float>(exact(i / 255.0));
            lower[i] = static_cast<float>(exact((i - 0.5) / 255.0));
        }
        lower[0] = 0.0f;
        lower[256] = std::numeric_limits<float>::infinity();
        int code = 0;
        for (int slot = 0; slot < kSlots; ++slot) {
            while (lower[code + 1] <= static_cast<float>(slot) / (kSlots - 1)) ++code;
            guess[slot] = static_cast<std::uint8_t>(code);
        }
    }
};

const SrgbTables& tables() {
    static const SrgbTables made;
    return made;
}

std::uint8_t code8(const SrgbTables& t, float linear) {
    if (!(linear > 0.0f)) return 0;
    if (linear >= 1.0f) return 255;
    int code = t.guess[static_cast<int>(linear * (SrgbTables::kSlots - 1))];
    while (linear >= t.lower[code + 1]) ++code;
    while (linear < t.lower[code]) --code;
    return static_cast<std::uint8_t>(code);
}

}  // namespace

std::uint8_t srgb8FromLinear(float linear) {
    return code8(tables(), linear);
}
float linearFromSrgb8(std::uint8_t code) {
    return tables().linear[code];
}

Image<glm::vec4> premultipliedLinear(const Texture& texture) {
    return premultipliedLinear(texture, 0, texture.height());
}

Image<glm::vec4> premultipliedLinear(const Texture& texture, int top, int rows) {
    Image<glm::vec4> out(texture.width(), rows);
    const SrgbTables& t = tables();
    parallelFor(0, rows, [&](std::int64_t row) {
        auto to = out.row(static_cast<int>(row));
        const int y = top + static_cast<int>(row);
        if (const auto* image = texture.rgba8()) {
            const auto from = image->row(y);
            for (std::size_t x = 0; x < to.size(); ++x) {
                const auto& p = from[x];
                const float a = static_cast<float>(p.a) / 255.0f;
                to[x] = {t.linear[p.r] * a, t.linear[p.g] * a, t.linear[p.b] * a, a};
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
    const SrgbTables& t = tables();
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
            to[x] = {code8(t, p.r * inverse), code8(t, p.g * inverse), code8(t, p.b * inverse), a};
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
