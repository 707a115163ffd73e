#include "lib/model/texture.hpp"

#include <algorithm>
#include <cmath>

namespace stx {

float srgbFromLinear(float linear) {
    if (!(linear > 0.0f)) return 0.0f;
    if (linear <= 0.0031308f) return linear * 12.92f;
    return 1.055f * std::pow(linear, 1.0f / 2.4f) - 0.055f;
}

float linearFromSrgb(float coded) {
    if (!(coded > 0.0f)) return 0.0f;
    if (coded <= 0.04045f) return coded / 12.92f;
    return std::pow((coded + 0.055f) / 1.055f, 2.4f);
}

namespace {

/// An image of half the size from premultiplied colours at(x, y) of a w x h image.
template <class At>
Image<glm::vec4> halved(int w, int h, const At& at) {
    Image<glm::vec4> half((w + 1) / 2, (h + 1) / 2);
    for (int y = 0; y < half.height(); ++y) {
        for (int x = 0; x < half.width(); ++x) {
            glm::vec4 sum(0.0f);
            for (int k = 0; k < 4; ++k) {
                const int sx = 2 * x + (k & 1), sy = 2 * y + (k >> 1);
                if (sx < w && sy < h) sum += at(sx, sy);
            }
            half.at(x, y) = sum.a > 1.0f ? sum / sum.a : sum;
        }
    }
    return half;
}

/// The colour that a pixel gets from the next coarser level, alpha 1; 0 when there is none.
/// Bilinear; its texel centres sit between two of ours, a quarter of a texel from the nearer one.
glm::vec4 fromHalf(const Image<glm::vec4>& half, int x, int y) {
    const int x0 = (x + 1) / 2 - 1, y0 = (y + 1) / 2 - 1;
    const float fx = (x & 1) ? 0.25f : 0.75f, fy = (y & 1) ? 0.25f : 0.75f;
    glm::vec4 sum(0.0f);
    for (int k = 0; k < 4; ++k) {
        const int sx = std::clamp(x0 + (k & 1), 0, half.width() - 1),
                  sy = std::clamp(y0 + (k >> 1), 0, half.height() - 1);
        const float wx = (k & 1) ? fx : 1.0f - fx;
        const float wy = (k >> 1) ? fy : 1.0f - fy;
        sum += half.at(sx, sy) * (wx * wy);
    }
    return sum.a > 0.0f ? sum / sum.a : glm::vec4(0.0f);
}

/// Pull-push on alpha-weighted colour: each level halves the image until one texel is left, then
/// the holes are filled on the way back up. Linear in the pixels, independent of hole shapes.
void fillHoles(Image<glm::vec4>& premultiplied) {
    if (premultiplied.width() <= 1 && premultiplied.height() <= 1) return;
    auto half = halved(premultiplied.width(), premultiplied.height(),
                       [&](int x, int y) { return premultiplied.at(x, y); });
    fillHoles(half);
    for (int y = 0; y < premultiplied.height(); ++y) {
        for (int x = 0; x < premultiplied.width(); ++x) {
            auto& p = premultiplied.at(x, y);
            if (!(p.a > 0.0f)) p = fromHalf(half, x, y);
        }
    }
}

}  // namespace

void bleedColour(Texture& texture) {
    // The finest level is the texture itself: floats of its size would be four times as large.
    const auto bleed = [&](auto& image, const auto& premultiplied, const auto& coded) {
        const auto pixels = image.pixels();
        if (std::none_of(pixels.begin(), pixels.end(), [](const auto& p) { return !(p.a > 0); }))
            return;
        auto half = halved(image.width(), image.height(),
                           [&](int x, int y) { return premultiplied(image.at(x, y)); });
        fillHoles(half);
        for (int y = 0; y < image.height(); ++y) {
            for (int x = 0; x < image.width(); ++x) {
                auto& p = image.at(x, y);
                if (p.a > 0) continue;
                const glm::vec4 filled = fromHalf(half, x, y);
                if (filled.a > 0.0f) p = coded(filled / filled.a);
            }
        }
    };
    const auto byAlpha = [](glm::vec4 c) {
        return c.a > 0.0f ? glm::vec4(glm::vec3(c) * c.a, c.a) : glm::vec4(0.0f);
    };
    if (auto* bytes = texture.rgba8())
        bleed(
            *bytes, [&](glm::u8vec4 p) { return byAlpha(glm::vec4(p) * (1.0f / 255.0f)); },
            [](glm::vec4 c) {
                return glm::u8vec4(glm::clamp(glm::vec3(c), 0.0f, 1.0f) * 255.0f + 0.5f, 0);
            });
    else
        bleed(*texture.rgbaFloat(), byAlpha,
              [](glm::vec4 c) { return glm::vec4(glm::vec3(c), 0.0f); });
}

}  // namespace stx
