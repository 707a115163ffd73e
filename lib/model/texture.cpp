#include "lib/model/texture.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "lib/base/float4.hpp"

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

bool isBeyondWhite(const Texture& texture) {
    constexpr float kWhite = 1.0f + 1e-6f;
    const RgbaFloatImage* image = texture.rgbaFloat();
    return image && std::ranges::any_of(image->pixels(), [](const glm::vec4& c) {
               return c.a > 0.0f && std::max({c.r, c.g, c.b}) > kWhite;
           });
}

Result<void> Texture::check() const {
    const auto* linear = rgbaFloat();
    if (!linear) return {};
    const auto finite = [](const glm::vec4& c) { return c * 0.0f == glm::vec4(0.0f); };
    const auto wrong = std::ranges::find_if_not(linear->pixels(), finite);
    if (wrong == linear->pixels().end()) return {};
    const auto at = static_cast<int>(wrong - linear->pixels().begin());
    return fail(ErrorCode::invalidInput, "a colour at column {}, row {} is not finite",
                at % linear->width(), at / linear->width());
}

namespace {

constexpr Float4 kNothing = {};

/// An image of half the size from premultiplied colours at(x, y) of a w x h image.
template <class At>
Image<glm::vec4> halved(int w, int h, const At& at) {
    Image<glm::vec4> half((w + 1) / 2, (h + 1) / 2);
    for (int y = 0; y < half.height(); ++y) {
        for (int x = 0; x < half.width(); ++x) {
            Float4 sum = kNothing;
            for (int k = 0; k < 4; ++k) {
                const int sx = 2 * x + (k & 1), sy = 2 * y + (k >> 1);
                if (sx < w && sy < h) sum += at(sx, sy);
            }
            half.at(x, y) = vectorOf(sum[3] > 1.0f ? sum / sum[3] : sum);
        }
    }
    return half;
}

/// The colours that pixels of a row get from the next coarser level, alpha 1; 0 when there is none.
/// Bilinear; its texel centres sit between two of ours, a quarter of a texel from the nearer one.
class FromHalf {
  public:
    FromHalf(const Image<glm::vec4>& half, int y)
        : last_(half.width() - 1),
          above_(half.row(std::clamp((y + 1) / 2 - 1, 0, half.height() - 1))),
          below_(half.row(std::clamp((y + 1) / 2, 0, half.height() - 1))),
          along_((y & 1) ? 0.25f : 0.75f) {}

    [[nodiscard]] Float4 at(int x) const {
        const int x0 = std::clamp((x + 1) / 2 - 1, 0, last_),
                  x1 = std::clamp((x + 1) / 2, 0, last_);
        const float fx = (x & 1) ? 0.25f : 0.75f;
        const auto tap = [](const glm::vec4& c, float weight) { return floatsOf(c) * weight; };
        const Float4 sum = kNothing + tap(above_[x0], (1.0f - fx) * (1.0f - along_)) +
                           tap(above_[x1], fx * (1.0f - along_)) +
                           tap(below_[x0], (1.0f - fx) * along_) + tap(below_[x1], fx * along_);
        return sum[3] > 0.0f ? sum / sum[3] : kNothing;
    }

  private:
    int last_;
    std::span<const glm::vec4> above_, below_;
    float along_;
};

/// Pull-push on alpha-weighted colour: each level halves the image until one texel is left, then
/// the holes are filled on the way back up. Linear in the pixels, independent of hole shapes.
void fillHoles(Image<glm::vec4>& premultiplied) {
    if (premultiplied.width() <= 1 && premultiplied.height() <= 1) return;
    auto half = halved(premultiplied.width(), premultiplied.height(),
                       [&](int x, int y) { return floatsOf(premultiplied.at(x, y)); });
    fillHoles(half);
    for (int y = 0; y < premultiplied.height(); ++y) {
        const FromHalf coarser(half, y);
        for (int x = 0; x < premultiplied.width(); ++x) {
            auto& p = premultiplied.at(x, y);
            if (!(p.a > 0.0f)) p = vectorOf(coarser.at(x));
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
            const FromHalf coarser(half, y);
            for (int x = 0; x < image.width(); ++x) {
                auto& p = image.at(x, y);
                if (p.a > 0) continue;
                const Float4 filled = coarser.at(x);
                if (filled[3] > 0.0f) p = coded(filled);
            }
        }
    };
    const auto byAlpha = [](Float4 c) {
        if (!(c[3] > 0.0f)) return kNothing;
        return c * Float4{c[3], c[3], c[3], 1.0f};
    };
    if (auto* bytes = texture.rgba8())
        bleed(
            *bytes,
            [&](glm::u8vec4 p) {
                return p.a > 0 ? byAlpha(floatsOf(p) * (1.0f / 255.0f)) : kNothing;
            },
            [](Float4 c) {
                // Means of 0..1: rounding adds too little for a code of 256.
                const auto code = __builtin_convertvector(c * 255.0f + 0.5f, Int4);
                return glm::u8vec4(code[0], code[1], code[2], 0);
            });
    else
        bleed(
            *texture.rgbaFloat(), [&](const glm::vec4& c) { return byAlpha(floatsOf(c)); },
            [](Float4 c) { return glm::vec4(c[0], c[1], c[2], 0.0f); });
}

}  // namespace stx
