#include <algorithm>
#include <atomic>
#include <string_view>
#include <utility>

#include "formats/images/images.hpp"
#include "lib/base/parallel.hpp"
#include "lib/model/texture.hpp"

namespace stx {

namespace {

/// Index of the channel with that name; -1 = none.
int channelNamed(const DecodedImage& image, std::string_view name) {
    for (int i = 0; i < image.channels; ++i) {
        if (image.channelNames[i] == name) return i;
    }
    return -1;
}

struct ColourChannels {
    int r = 0, g = 0, b = 0, a = -1;  ///< indices; a = -1: there is no alpha
};

/// Where an image's colour stands: R G B or Y by name, else by position.
ColourChannels colourChannels(const DecodedImage& image) {
    int r = channelNamed(image, "R"), g = channelNamed(image, "G"), b = channelNamed(image, "B");
    int a = channelNamed(image, "A");
    if (const int y = channelNamed(image, "Y"); r < 0 && g < 0 && b < 0 && y >= 0) {
        r = g = b = y;
    } else if (r < 0 || g < 0 || b < 0) {
        const bool grey = image.channels < 3;
        r = 0;
        g = grey ? 0 : 1;
        b = grey ? 0 : 2;
        if (a < 0 && (image.channels == 2 || image.channels == 4)) a = image.channels - 1;
        if (a == 0) a = -1;
    }
    return {r, g, b, a};
}

}  // namespace

std::string toRec709(DecodedImage& image) {
    const int r = channelNamed(image, "R"), g = channelNamed(image, "G"),
              b = channelNamed(image, "B");
    auto* values = std::get_if<std::vector<float>>(&image.values);
    if (image.coloursNote.empty() || !values || r < 0 || g < 0 || b < 0) return {};
    if (image.rec709FromRgb) {
        const glm::mat3 matrix(*image.rec709FromRgb);
        for (std::size_t i = 0; i < values->size(); i += static_cast<std::size_t>(image.channels)) {
            float* const p = values->data() + i;
            const glm::vec3 rgb = matrix * glm::vec3(p[r], p[g], p[b]);
            p[r] = rgb.r;
            p[g] = rgb.g;
            p[b] = rgb.b;
        }
    }
    image.rec709FromRgb.reset();
    return std::exchange(image.coloursNote, {});
}

void Rgba8Loss::add(const Rgba8Loss& other) {
    bits = std::max(bits, other.bits);
    linear = linear || other.linear;
    clipped = clipped || other.clipped;
}

void Rgba8Loss::note(Job& job) const {
    if (bits > 8) job.note(fmt::format("colour of {} bits is rounded to 8", bits));
    if (linear)
        job.note(clipped ? "linear colour becomes 8-bit sRGB; values above 1 are clipped"
                         : "linear colour becomes 8-bit sRGB");
}

Image<glm::u8vec4> rgba8From(const DecodedImage& image, Rgba8Loss* loss) {
    Image<glm::u8vec4> out(image.width, image.height);
    Rgba8Loss lost;
    const ColourChannels at = colourChannels(image);
    const int r = at.r, g = at.g, b = at.b, a = at.a;
    const auto pixel = [&](const auto* values, const auto& coded) {
        parallelFor(0, image.height, [&](std::int64_t y) {
            const auto* p = values + static_cast<std::size_t>(y) * image.width * image.channels;
            for (auto& q : out.row(static_cast<int>(y))) {
                q = coded(p[r], p[g], p[b], a < 0 ? nullptr : p + a);
                p += image.channels;
            }
        });
    };
    const bool premultiplied = image.premultiplied && a >= 0;
    // Integers, of which `white` is the largest.
    const auto integers = [&](const auto* values, std::uint32_t white) {
        const auto to8 = [white](std::uint32_t v) {
            return static_cast<std::uint8_t>((v * 255u + white / 2) / white);
        };
        pixel(values, [&](auto red, auto green, auto blue, const auto* alpha) {
            const std::uint32_t cover = alpha ? *alpha : white;
            const auto colour = [&](std::uint32_t v) {
                if (premultiplied && cover > 0)
                    v = std::min((v * white + cover / 2) / cover, white);
                return to8(v);
            };
            return glm::u8vec4(colour(red), colour(green), colour(blue), to8(cover));
        });
    };
    if (const auto* v8 = std::get_if<0>(&image.values); v8 && !premultiplied) {
        // What most pictures are: nothing to compute.
        pixel(v8->data(), [](auto red, auto green, auto blue, const auto* alpha) {
            return glm::u8vec4(red, green, blue, alpha ? *alpha : 255);
        });
    } else if (v8) {
        integers(v8->data(), 255);
    } else if (const auto* v16 = std::get_if<1>(&image.values)) {
        integers(v16->data(), 65535);
        lost.bits = 16;
    } else {
        const auto to8 = [](float v) {
            return static_cast<std::uint8_t>(std::clamp(v, 0.0f, 1.0f) * 255.0f + 0.5f);
        };
        std::atomic<bool> clipped = false;
        const auto colour = [&](float v, float alpha) {
            if (premultiplied && alpha > 0.0f) v /= alpha;
            // Beyond what dividing by alpha rounds.
            if (!(v <= 1.0f + 1e-6f) || v < 0.0f) clipped.store(true, std::memory_order_relaxed);
            return to8(image.linear ? srgbFromLinear(v) : v);
        };
        pixel(std::get<2>(image.values).data(),
              [&](float red, float green, float blue, const float* alpha) {
                  const float cover = alpha ? *alpha : 1.0f;
                  return glm::u8vec4(colour(red, cover), colour(green, cover), colour(blue, cover),
                                     to8(cover));
              });
        lost.linear = image.linear;
        if (!image.linear) lost.bits = 32;
        lost.clipped = clipped;
    }
    if (loss) loss->add(lost);
    return out;
}

Image<glm::vec4> rgbaFloatFrom(const DecodedImage& image) {
    Image<glm::vec4> out(image.width, image.height);
    const ColourChannels at = colourChannels(image);
    const int r = at.r, g = at.g, b = at.b, a = at.a;
    std::visit(
        [&](const auto& values) {
            using Value = typename std::decay_t<decltype(values)>::value_type;
            constexpr float kWhite = std::is_same_v<Value, std::uint8_t>    ? 255.0f
                                     : std::is_same_v<Value, std::uint16_t> ? 65535.0f
                                                                            : 1.0f;
            const auto* p = values.data();
            for (auto& q : out.pixels()) {
                // Divided: v of 255 and 257 v of 65535 are one float then.
                const float alpha = a < 0 ? 1.0f : static_cast<float>(p[a]) / kWhite;
                q = glm::vec4(p[r] / kWhite, p[g] / kWhite, p[b] / kWhite, alpha);
                if (image.premultiplied && alpha > 0.0f) q = glm::vec4(glm::vec3(q) / alpha, alpha);
                p += image.channels;
            }
        },
        image.values);
    return out;
}

namespace {

/// maskFrom() of pixels whose largest code is `largest`; codeOf() gives the codes of one.
template <class P, class CodeOf>
Image<std::uint8_t> maskOf(const Image<P>& picture, std::uint32_t largest, std::string& note,
                           CodeOf codeOf) {
    Image<std::uint8_t> mask(picture.width(), picture.height());
    std::uint32_t low = largest, high = 0;
    const auto shareOf = [&](std::size_t i) {
        const glm::uvec4 p = codeOf(picture.data()[i]);
        // Luma of BT.709 in ten-thousandths, which gives greys back exactly.
        const std::uint32_t luma = (2126 * p.r + 7152 * p.g + 722 * p.b + 5000) / 10000;
        return static_cast<std::uint32_t>((std::uint64_t{luma} * p.a + largest / 2) / largest);
    };
    for (std::size_t i = 0; i < mask.count(); ++i) {
        const std::uint32_t share = shareOf(i);
        if (share > 0) low = std::min(low, share);
        high = std::max(high, share);
    }
    const bool oneValue = low == high;
    for (std::size_t i = 0; i < mask.count(); ++i) {
        const std::uint32_t share = oneValue && shareOf(i) > 0 ? largest : shareOf(i);
        mask.data()[i] =
            static_cast<std::uint8_t>((share * std::uint64_t{255} + largest / 2) / largest);
    }
    if (oneValue && high < largest)
        note = fmt::format("the one value of the mask beside 0, {} of {}, is taken for inside",
                           high, largest);
    return mask;
}

}  // namespace

Image<std::uint8_t> maskFrom(const Image<glm::u8vec4>& picture, std::string& note) {
    return maskOf(picture, 255, note, [](glm::u8vec4 p) { return glm::uvec4(p); });
}

Image<std::uint8_t> maskFrom(const Image<glm::vec4>& picture, std::string& note) {
    static constexpr float kLargest = 65535;
    return maskOf(picture, 65535, note, [](glm::vec4 p) {
        return glm::uvec4(glm::clamp(p, 0.0f, 1.0f) * kLargest + 0.5f);
    });
}

}  // namespace stx
