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

namespace {

void divideByAlpha(std::span<const glm::vec4> from, std::span<glm::u8vec4> to) {
    const Srgb8Tables& t = srgb8Tables();
    for (std::size_t x = 0; x < to.size(); ++x) {
        const auto& p = from[x];
        const int a = p.a >= 1.0f ? 255 : p.a > 0.0f ? static_cast<int>(p.a * 255.0f + 0.5f) : 0;
        const float inverse = a > 0 ? 255.0f / static_cast<float>(a) : 0.0f;
        to[x] = a > 0 ? glm::u8vec4(t.code(p.r * inverse), t.code(p.g * inverse),
                                    t.code(p.b * inverse), a)
                      : glm::u8vec4(0);
    }
}

/// In place, too.
void divideByAlpha(std::span<const glm::vec4> from, std::span<glm::vec4> to) {
    for (std::size_t x = 0; x < to.size(); ++x) {
        const auto& p = from[x];
        to[x] = p.a > 0.0f ? glm::vec4(glm::vec3(p) / p.a, p.a) : glm::vec4(0.0f);
    }
}

template <class Pixel>
Texture straight(const Image<glm::vec4>& premultiplied) {
    Image<Pixel> out(premultiplied.width(), premultiplied.height());
    parallelFor(0, out.height(), [&](std::int64_t row) {
        const int y = static_cast<int>(row);
        divideByAlpha(premultiplied.row(y), out.row(y));
    });
    Texture texture(std::move(out));
    bleedColour(texture);
    return texture;
}

/// R, G, B, A of a part, or Y in the place of R.
struct ColourChannels {
    bool colour, grey, alpha;
    std::optional<glm::mat3> rec709;  ///< see ExrPart::rec709FromRgb

    explicit ColourChannels(const ExrPart& part)
        : colour(part.channel("R") && part.channel("G") && part.channel("B")),
          grey(!colour && part.channel("Y")),
          alpha(part.channel("A") != nullptr),
          rec709(part.rec709FromRgb) {}

    void add(glm::vec4* rows, std::vector<ExrPixels>& pixels) const {
        float* at = &rows->x;
        if (colour) pixels.insert(pixels.end(), {{"R", at, 4}, {"G", at + 1, 4}, {"B", at + 2, 4}});
        if (grey) pixels.push_back({"Y", at, 4});
        if (alpha) pixels.push_back({"A", at + 3, 4});
    }
    /// What the file has no channels for; colours as those of Rec. 709.
    void complete(std::span<glm::vec4> row) const {
        if (colour && rec709)
            for (glm::vec4& p : row) p = glm::vec4(*rec709 * glm::vec3(p), p.a);
        if (colour && alpha) return;
        for (glm::vec4& p : row) {
            if (!colour) p.g = p.b = p.r;
            if (!alpha) p.a = 1.0f;
        }
    }
};

}  // namespace

Texture textureFromPremultiplied8(const Image<glm::vec4>& premultiplied) {
    return straight<glm::u8vec4>(premultiplied);
}

Texture textureFromPremultiplied(const Image<glm::vec4>& premultiplied) {
    return straight<glm::vec4>(premultiplied);
}

Result<Texture> readTexture(const ExrReader& reader, int index, bool linear,
                            const std::vector<ExrPixels>& others) {
    const ExrPart& part = reader.parts()[index];
    const ColourChannels channels(part);
    Texture texture = linear ? Texture(RgbaFloatImage(part.width, part.height))
                             : Texture(Rgba8Image(part.width, part.height));
    // A whole picture's colours as floats would be three times what is made of them.
    Image<glm::vec4> block;
    const auto rowOf = [&](int y, int row) {
        return linear ? texture.rgbaFloat()->row(y + row) : block.row(row);
    };
    const auto place = [&](int y, int rows) {
        if (!linear && block.height() != rows) block = Image<glm::vec4>(part.width, rows);
        std::vector<ExrPixels> pixels;
        channels.add(rowOf(y, 0).data(), pixels);
        for (ExrPixels other : others) {
            other.values += static_cast<std::size_t>(y) * part.width * other.stride;
            pixels.push_back(std::move(other));
        }
        return pixels;
    };
    STX_CHECK(reader.readPart(index, place, [&](int y, int rows) {
        parallelFor(0, rows, [&](int i) {
            const auto row = rowOf(y, i);
            channels.complete(row);
            if (linear)
                divideByAlpha(row, row);
            else
                divideByAlpha(row, texture.rgba8()->row(y + i));
        });
    }));
    bleedColour(texture);
    return texture;
}

}  // namespace stx
