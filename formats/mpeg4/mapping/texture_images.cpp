#include "formats/mpeg4/mapping/texture_images.hpp"

#include <cmath>

namespace stx::mpeg4 {
namespace {

/// Calls body(values, cmax) with the integer samples of an image.
template <class Body>
Result<void> withSamples(const DecodedImage& image, std::string_view what, Body body) {
    if (const auto* v = std::get_if<std::vector<std::uint8_t>>(&image.values)) {
        body(*v, 255u);
    } else if (const auto* w = std::get_if<std::vector<std::uint16_t>>(&image.values)) {
        body(*w, 65535u);
    } else {
        return fail(ErrorCode::invalidInput,
                    "the {} image has float samples; 8 or 16 bits are possible", what);
    }
    return {};
}

/// Red, green and blue of each pixel as vectors of -1..1.
Result<Image<glm::vec3>> signedVectors(const DecodedImage& image, std::string_view what) {
    if (image.channels < 3)
        return fail(ErrorCode::invalidInput, "the {} image has {} channel(s); RGB is expected",
                    what, image.channels);
    Image<glm::vec3> out(image.width, image.height);
    STX_CHECK(withSamples(image, what, [&](const auto& values, unsigned cmax) {
        for (std::size_t i = 0; i < out.count(); ++i)
            for (int c = 0; c < 3; ++c)
                out.pixels()[i][c] = static_cast<float>(
                    2.0 * values[i * static_cast<std::size_t>(image.channels) + c] / cmax - 1.0);
    }));
    return out;
}

/// Codes of `bits` for 3 components each given in -1..1 by get(pixel).
template <class Get>
Result<Bytes> vectorPng(const Image<glm::vec3>& image, int bits, const Padding& padding, Get get) {
    const int width = image.width() + padding.left + padding.right;
    const int height = image.height() + padding.top + padding.bottom;
    const auto fill = [&](auto& codes, double cmax) {
        codes.assign(static_cast<std::size_t>(width) * height * 3, 0);
        for (int y = 0; y < image.height(); ++y) {
            for (int x = 0; x < image.width(); ++x) {
                const glm::dvec3 v = get(image.at(x, y));
                auto* out =
                    &codes[(static_cast<std::size_t>(y + padding.top) * width + x + padding.left) *
                           3];
                for (int c = 0; c < 3; ++c)
                    out[c] = static_cast<std::decay_t<decltype(*out)>>(
                        std::lround(std::clamp((v[c] + 1.0) / 2.0, 0.0, 1.0) * cmax));
            }
        }
    };
    if (bits == 8) {
        std::vector<std::uint8_t> codes;
        fill(codes, 255.0);
        return encodePng(width, height, 3, 8, codes.data(), false);
    }
    std::vector<std::uint16_t> codes;
    fill(codes, 65535.0);
    return encodePng(width, height, 3, 16, codes.data(), false);
}

}  // namespace

DecodedImage decodedFromPixels(const PixelImage& image) {
    DecodedImage out;
    out.width = image.width;
    out.height = image.height;
    out.channels = image.components;
    out.channelNames = image.components == 1   ? std::vector<std::string>{"Y"}
                       : image.components == 2 ? std::vector<std::string>{"Y", "A"}
                       : image.components == 3 ? std::vector<std::string>{"R", "G", "B"}
                                               : std::vector<std::string>{"R", "G", "B", "A"};
    const std::size_t row = static_cast<std::size_t>(image.width) * image.components;
    std::vector<std::uint8_t> values(row * image.height);
    for (int y = 0; y < image.height; ++y)
        std::copy_n(image.pixels.begin() + static_cast<std::ptrdiff_t>(row * y), row,
                    values.begin() + static_cast<std::ptrdiff_t>(row * (image.height - 1 - y)));
    out.values = std::move(values);
    return out;
}

Result<Image<float>> depthFromImage(const DecodedImage& image, int channel, int greyBits,
                                    double nearPlane, double farPlane) {
    Image<float> depth(image.width, image.height, kNoDepth);
    STX_CHECK(withSamples(image, "depth", [&](const auto& values, unsigned cmax) {
        const bool few = greyBits == 1 || greyBits == 2 || greyBits == 4;
        const int bits = image.usedBits > 0 ? image.usedBits : few ? greyBits : 0;
        const DepthCode code{nearPlane, farPlane, bits > 0 ? (1u << bits) - 1 : cmax};
        // PNG's few bits are spread over eight; video's are not spread.
        const unsigned spread = image.usedBits > 0 ? 1 : cmax / code.dmax;
        for (std::size_t i = 0; i < depth.count(); ++i) {
            const unsigned d =
                values[i * static_cast<std::size_t>(image.channels) + channel] / spread;
            if (d == 0) continue;
            // One bit only: 1 is both planes; take the far one, as in a PointTexture.
            depth.pixels()[i] = static_cast<float>(code.dmax == 1 ? farPlane : code.decode(d));
        }
    }));
    return depth;
}

bool isGrey(const DecodedImage& image) {
    if (image.channels < 3) return true;
    return std::visit(
        [&](const auto& values) {
            for (std::size_t i = 0; i + 2 < values.size();
                 i += static_cast<std::size_t>(image.channels))
                if (values[i] != values[i + 1] || values[i] != values[i + 2]) return false;
            return true;
        },
        image.values);
}

Result<Image<glm::vec3>> normalsFromImage(const DecodedImage& image, const Image<float>& depth) {
    STX_TRY(auto normals, signedVectors(image, "normal"));
    for (std::size_t i = 0; i < normals.count(); ++i) {
        glm::vec3& n = normals.pixels()[i];
        const float length = glm::length(n);
        // 0 0 0 decodes to the corner (-1,-1,-1): no normal.
        n = hasPoint(depth.pixels()[i]) && length > 0.25f && length < 1.5f ? n / length
                                                                           : glm::vec3(0);
    }
    return normals;
}

Result<Image<glm::vec3>> splatsFromImage(const DecodedImage& image, glm::vec2 splatMinMax,
                                         const Image<float>& depth) {
    STX_TRY(auto splats, signedVectors(image, "splat"));
    const float low = splatMinMax.x, high = splatMinMax.y;
    for (std::size_t i = 0; i < splats.count(); ++i) {
        glm::vec3& s = splats.pixels()[i];
        if (!hasPoint(depth.pixels()[i])) {
            s = glm::vec3(0);
        } else if (low < 0) {
            s = glm::vec3(low) + (high - low) * (s + 1.0f) * 0.5f;
        } else {
            const float length = glm::length(s);
            s = length > 1e-6f ? s / length * (low + (high - low) * std::min(1.0f, length))
                               : glm::vec3(0);
        }
    }
    return splats;
}

Result<Bytes> depthPng(const Image<float>& depth, const DepthCode& code, const Padding& padding,
                       double& worst) {
    const int width = depth.width() + padding.left + padding.right;
    const int height = depth.height() + padding.top + padding.bottom;
    worst = 0;
    std::optional<float> wrong;
    const auto fill = [&](auto& codes) {
        codes.assign(static_cast<std::size_t>(width) * height, 0);
        for (int y = 0; y < depth.height(); ++y) {
            for (int x = 0; x < depth.width(); ++x) {
                const float dist = depth.at(x, y);
                if (!(dist >= 0)) wrong = dist;
                if (!hasPoint(dist)) continue;
                const std::uint32_t d = code.encode(dist);
                worst = std::max(worst, std::abs(code.decode(d) - dist));
                codes[static_cast<std::size_t>(y + padding.top) * width + x + padding.left] =
                    static_cast<std::decay_t<decltype(codes[0])>>(d);
            }
        }
    };
    if (code.dmax == 255) {
        std::vector<std::uint8_t> codes;
        fill(codes);
        if (wrong) return depthError(*wrong);
        return encodePng(width, height, 1, 8, codes.data(), false);
    }
    std::vector<std::uint16_t> codes;
    fill(codes);
    if (wrong) return depthError(*wrong);
    return encodePng(width, height, 1, 16, codes.data(), false);
}

Result<Bytes> normalPng(const Image<glm::vec3>& normal, int bits, const Padding& padding) {
    return vectorPng(normal, bits, padding, [](glm::vec3 n) {
        return n == glm::vec3(0) ? glm::dvec3(-1) : glm::dvec3(n);
    });
}

Result<Bytes> splatPng(const Image<glm::vec3>& splat, float longest, int bits,
                       const Padding& padding) {
    return vectorPng(splat, bits, padding,
                     [&](glm::vec3 s) { return glm::dvec3(s) / static_cast<double>(longest); });
}

float largestComponent(const Image<glm::vec3>& image) {
    float largest = 0;
    for (const glm::vec3 v : image.pixels())
        for (int c = 0; c < 3; ++c) largest = std::max(largest, std::abs(v[c]));
    return largest;
}

Rgba8Image rgba8FromTexture(const Texture& texture, bool& clamped) {
    clamped = false;
    if (const Rgba8Image* image = texture.rgba8()) return *image;
    const RgbaFloatImage& image = *texture.rgbaFloat();
    Rgba8Image out(image.width(), image.height());
    for (std::size_t i = 0; i < out.count(); ++i) {
        const glm::vec4 p = image.pixels()[i];
        for (int c = 0; c < 4; ++c) {
            if (!(p[c] <= 1.0f + 1e-6f) || p[c] < 0) clamped = true;
            const float linear = p[c] > 0 ? std::min(p[c], 1.0f) : 0.0f;
            const float coded = c < 3 ? srgbFromLinear(linear) : linear;
            out.pixels()[i][c] = static_cast<std::uint8_t>(std::lround(coded * 255.0f));
        }
    }
    return out;
}

bool alphaFollowsDepth(const Rgba8Image& texture, const Image<float>& depth, bool prunedToo) {
    for (std::size_t i = 0; i < texture.count(); ++i) {
        const int alpha = texture.pixels()[i].a;
        const bool point = hasPoint(depth.pixels()[i]);
        if (alpha != (point ? 255 : 0) && !(prunedToo && !point && alpha == 255)) return false;
    }
    return true;
}

namespace {

/// Gives `put` the pixels of an image with padding around it, row by row.
template <class Put>
void eachPadded(const Rgba8Image& image, const Padding& padding, const Put& put) {
    const int width = image.width() + padding.left + padding.right;
    const int height = image.height() + padding.top + padding.bottom;
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const int fromX = x - padding.left, fromY = y - padding.top;
            glm::u8vec4 p = image.at(std::clamp(fromX, 0, image.width() - 1),
                                     std::clamp(fromY, 0, image.height() - 1));
            if (!image.contains(fromX, fromY)) p.a = 0;
            put(p);
        }
    }
}

std::vector<std::uint8_t> paddedRgb(const Rgba8Image& image, const Padding& padding) {
    std::vector<std::uint8_t> rgb;
    rgb.reserve(static_cast<std::size_t>(image.width() + padding.left + padding.right) *
                (image.height() + padding.top + padding.bottom) * 3);
    eachPadded(image, padding, [&](glm::u8vec4 p) { rgb.insert(rgb.end(), {p.r, p.g, p.b}); });
    return rgb;
}

}  // namespace

Rgba8Image padded(const Rgba8Image& image, const Padding& padding) {
    if (!padding.any()) return image;
    Rgba8Image out(image.width() + padding.left + padding.right,
                   image.height() + padding.top + padding.bottom);
    glm::u8vec4* to = out.data();
    eachPadded(image, padding, [&](glm::u8vec4 p) { *to++ = p; });
    return out;
}

Result<Bytes> colourPng(const Rgba8Image& image, bool alpha, const Padding& padding) {
    const int width = image.width() + padding.left + padding.right;
    const int height = image.height() + padding.top + padding.bottom;
    if (!alpha) return encodePng(width, height, 3, 8, paddedRgb(image, padding).data(), true);
    if (!padding.any()) return encodePng(width, height, 4, 8, image.data(), true);
    return encodePng(width, height, 4, 8, padded(image, padding).data(), true);
}

Result<Bytes> colourJpeg(const Rgba8Image& image, int quality, const Padding& padding) {
    return encodeJpeg(image.width() + padding.left + padding.right,
                      image.height() + padding.top + padding.bottom, 3,
                      paddedRgb(image, padding).data(), quality);
}

}  // namespace stx::mpeg4
