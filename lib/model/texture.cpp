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

/// Pull-push on alpha-weighted colour: each level halves the image until one texel is left, then
/// the holes are filled on the way back up. Linear in the pixels, independent of hole shapes.
void fillHoles(Image<glm::vec4>& premultiplied) {
    if (premultiplied.width() <= 1 && premultiplied.height() <= 1) return;
    const int w = (premultiplied.width() + 1) / 2, h = (premultiplied.height() + 1) / 2;
    Image<glm::vec4> half(w, h);
    for (int y = 0; y < h; ++y) {
        for (int x = 0; x < w; ++x) {
            glm::vec4 sum(0.0f);
            for (int k = 0; k < 4; ++k) {
                const int sx = 2 * x + (k & 1), sy = 2 * y + (k >> 1);
                if (premultiplied.contains(sx, sy)) sum += premultiplied.at(sx, sy);
            }
            half.at(x, y) = sum.a > 1.0f ? sum / sum.a : sum;
        }
    }
    fillHoles(half);
    for (int y = 0; y < premultiplied.height(); ++y) {
        for (int x = 0; x < premultiplied.width(); ++x) {
            auto& p = premultiplied.at(x, y);
            if (p.a > 0.0f) continue;
            // Bilinear from the coarser level; its texel centres sit between two of ours.
            const float fx = (x + 0.5f) * 0.5f - 0.5f, fy = (y + 0.5f) * 0.5f - 0.5f;
            const int x0 = static_cast<int>(std::floor(fx)), y0 = static_cast<int>(std::floor(fy));
            glm::vec4 sum(0.0f);
            for (int k = 0; k < 4; ++k) {
                const int sx = std::clamp(x0 + (k & 1), 0, w - 1),
                          sy = std::clamp(y0 + (k >> 1), 0, h - 1);
                const float wx = (k & 1) ? fx - x0 : 1.0f - (fx - x0);
                const float wy = (k >> 1) ? fy - y0 : 1.0f - (fy - y0);
                sum += half.at(sx, sy) * (wx * wy);
            }
            if (sum.a > 0.0f) p = sum / sum.a;
        }
    }
}

}  // namespace

void bleedColour(Texture& texture) {
    if (texture.empty()) return;
    Image<glm::vec4> work(texture.width(), texture.height());
    for (int y = 0; y < work.height(); ++y) {
        for (int x = 0; x < work.width(); ++x) {
            const glm::vec4 c = texture.at(x, y);
            if (c.a > 0.0f) work.at(x, y) = glm::vec4(glm::vec3(c) * c.a, c.a);
        }
    }
    fillHoles(work);
    for (int y = 0; y < work.height(); ++y) {
        for (int x = 0; x < work.width(); ++x) {
            const glm::vec4 filled = work.at(x, y);
            if (auto* image = texture.rgba8()) {
                auto& p = image->at(x, y);
                if (p.a == 0 && filled.a > 0.0f)
                    p = glm::u8vec4(
                        glm::clamp(glm::vec3(filled) / filled.a, 0.0f, 1.0f) * 255.0f + 0.5f, 0);
            } else {
                auto& p = texture.rgbaFloat()->at(x, y);
                if (!(p.a > 0.0f) && filled.a > 0.0f)
                    p = glm::vec4(glm::vec3(filled) / filled.a, 0.0f);
            }
        }
    }
}

}  // namespace stx
