#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "lib/model/texture.hpp"

namespace stx {

/// Rows of a frame's luma, 0..255.
struct LumaRows {
    int width = 0, first = 0, rows = 0;  ///< rows first .. first + rows - 1 of the picture
    std::vector<std::uint8_t> values;
    std::vector<std::uint8_t> seen;  ///< 0 or 1, where the picture shows something
    bool allSeen = true;

    /// Takes them from a picture.
    void take(const Rgba8Image& picture, int firstRow, int rowCount);
    [[nodiscard]] const std::uint8_t* row(int y) const {
        return values.data() + static_cast<std::size_t>(y - first) * width;
    }
    [[nodiscard]] const std::uint8_t* seenRow(int y) const {
        return seen.data() + static_cast<std::size_t>(y - first) * width;
    }
};

/// What two frames that follow each other differ by.
enum class MotionScore {
    luma,  ///< |change of luma|
    /// |change of the nearest-neighbour pixel gradient|: light that gets brighter or darker
    /// everywhere does not count as motion.
    gradient,
};

/// How much moves around a pixel between two frames, the "quantity of motion" of LaBGen-P
/// (Laugraud, Van Droogenbroeck 2017): the sum of the scores in a square window around it, cut at
/// the borders of the picture. Where one of the frames shows something and the other nothing, all
/// has moved that can.
class MotionWindow {
  public:
    /// Of pictures of width x height; the window's side is min(width, height) / divisor, made odd,
    /// at most kLargestSide.
    MotionWindow(int width, int height, int divisor, MotionScore score);

    /// The largest score of a pixel: two differences of two differences of luma.
    static constexpr int kMostScore = 1020;
    /// Sums do not leave 32 bits up to this side.
    static constexpr int kLargestSide = 2047;

    /// Rows of luma that quantities of rows [first, first + rows) need: the first, and how many.
    [[nodiscard]] int firstNeeded(int first) const;
    [[nodiscard]] int rowsNeeded(int first, int rows) const;
    /// Pixels of the window around one.
    [[nodiscard]] int pixels(int x, int y) const;
    /// The quantities of rows [first, first + rows), row by row, of `rows` * width values.
    void quantities(const LumaRows& before, const LumaRows& now, int first, int rows,
                    std::span<std::uint32_t> to) const;

  private:
    void scores(const LumaRows& before, const LumaRows& now, int y, std::uint16_t* to) const;

    int width_, height_, radius_;
    MotionScore score_;
};

}  // namespace stx
