#pragma once

#include <string_view>

#include <glm/glm.hpp>

#include "lib/base/image.hpp"

namespace stx {

/// 8-bit sRGB without alpha: what sheets are made of.
using Rgb8Image = Image<glm::u8vec3>;

/// A picture that is drawn on: boxes, pictures and text. What lies outside is cut off.
class Canvas {
  public:
    static constexpr int kGlyphWidth = 7;  ///< pixels from one character to the next
    static constexpr int kLineHeight = 15;

    Canvas(int width, int height, glm::u8vec3 paper);

    void fill(glm::ivec2 corner, glm::ivec2 size, glm::u8vec3 colour);
    /// The outline, one pixel wide, inside of the box.
    void frame(glm::ivec2 corner, glm::ivec2 size, glm::u8vec3 colour);
    void picture(glm::ivec2 corner, const Rgb8Image& picture);
    /// One line of UTF-8 whose top left corner is `corner`, in at most `room` pixels: what is
    /// longer is cut and ends in two dots. ASCII and Latin-1 are drawn, a box for all else.
    void text(glm::ivec2 corner, std::string_view line, glm::u8vec3 colour, int room);

    [[nodiscard]] const Rgb8Image& image() const { return image_; }

  private:
    Rgb8Image image_;
};

}  // namespace stx
