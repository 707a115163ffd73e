#pragma once

#include <cstdint>
#include <variant>

#include <glm/glm.hpp>

#include "lib/base/image.hpp"
#include "lib/base/result.hpp"

namespace stx {

/// 8-bit sRGB colour with straight (not premultiplied) alpha, 255 = fully covered.
using Rgba8Image = Image<glm::u8vec4>;
/// Linear light, Rec. 709 primaries, straight alpha in 0..1; colours may exceed 1.
using RgbaFloatImage = Image<glm::vec4>;

/// Colour of a reference view: display-referred 8-bit sRGB or scene-referred linear float.
/// Alpha is coverage: 0 = background, between = a silhouette's pixel. Colours under alpha 0 are
/// bled from the object (see bleedColour()), so filters never mix in background.
class Texture {
  public:
    Texture() = default;
    Texture(Rgba8Image image) : image_(std::move(image)) {}      // NOLINT: a texture is either
    Texture(RgbaFloatImage image) : image_(std::move(image)) {}  // NOLINT

    [[nodiscard]] bool isLinear() const { return std::holds_alternative<RgbaFloatImage>(image_); }
    [[nodiscard]] const Rgba8Image* rgba8() const { return std::get_if<Rgba8Image>(&image_); }
    [[nodiscard]] const RgbaFloatImage* rgbaFloat() const {
        return std::get_if<RgbaFloatImage>(&image_);
    }
    [[nodiscard]] Rgba8Image* rgba8() { return std::get_if<Rgba8Image>(&image_); }
    [[nodiscard]] RgbaFloatImage* rgbaFloat() { return std::get_if<RgbaFloatImage>(&image_); }

    [[nodiscard]] int width() const {
        return std::visit([](const auto& i) { return i.width(); }, image_);
    }
    [[nodiscard]] int height() const {
        return std::visit([](const auto& i) { return i.height(); }, image_);
    }
    [[nodiscard]] bool empty() const { return width() == 0; }
    /// Error (invalidInput): a colour or alpha that is not finite, with its place.
    [[nodiscard]] Result<void> check() const;

    /// Straight RGBA as floats in the image's own space: 8-bit values / 255 (still sRGB-coded), or
    /// the linear floats as they are.
    [[nodiscard]] glm::vec4 at(int x, int y) const {
        if (const auto* i = rgba8()) return glm::vec4(i->at(x, y)) * (1.0f / 255.0f);
        return rgbaFloat()->at(x, y);
    }

    /// The same of a pixel by its number, row by row.
    [[nodiscard]] glm::vec4 at(std::size_t pixel) const {
        if (const auto* i = rgba8()) return glm::vec4(i->data()[pixel]) * (1.0f / 255.0f);
        return rgbaFloat()->data()[pixel];
    }
    /// Its coverage, 0..1.
    [[nodiscard]] float alpha(std::size_t pixel) const {
        if (const auto* i = rgba8()) return i->data()[pixel].a * (1.0f / 255.0f);
        return rgbaFloat()->data()[pixel].a;
    }

    /// Calls visit(x) for the pixels of a row whose coverage is neither 0 nor 1, from left to
    /// right.
    template <class Visit>
    void forEachInPart(int y, const Visit& visit) const {
        const auto look = [&](auto row, const auto& isInPart) {
            for (std::size_t x = 0; x < row.size(); ++x)
                if (isInPart(row[x].a)) visit(static_cast<int>(x));
        };
        if (const auto* bytes = rgba8())
            look(bytes->row(y),
                 [](std::uint8_t a) { return static_cast<std::uint8_t>(a - 1) < 254; });
        else
            look(rgbaFloat()->row(y), [](float a) { return a > 0.0f && a < 1.0f; });
    }

    /// See Image::moveTo().
    void moveTo(PixelSpool* spool) {
        std::visit([spool](auto& i) { i.moveTo(spool); }, image_);
    }

    bool operator==(const Texture&) const = default;

  private:
    std::variant<Rgba8Image, RgbaFloatImage> image_;
};

/// sRGB transfer function (IEC 61966-2-1), one value.
[[nodiscard]] float srgbFromLinear(float linear);
[[nodiscard]] float linearFromSrgb(float coded);

/// Whether linear colour that shows (alpha above 0) is brighter than white by more than rounding
/// makes it (1e-6): what holds sRGB of 0..1 clips it.
[[nodiscard]] bool isBeyondWhite(const Texture& texture);

/// Gives each pixel of alpha 0 the colour of the nearest covered ones, outward from the silhouette,
/// so that bilinear and wider filters never mix in background. Alpha is left as it is. Pixels
/// further than the object's reach get its mean colour, which keeps PNG and JPEG small.
void bleedColour(Texture& texture);

}  // namespace stx
