#include "lib/background/still_motion.hpp"

#include <algorithm>
#include <cstdlib>

#include "lib/background/still_frames.hpp"

namespace stx {

void LumaRows::take(const Rgba8Image& picture, int firstRow, int rowCount) {
    width = picture.width();
    first = firstRow;
    rows = rowCount;
    values.resize(static_cast<std::size_t>(rows) * width);
    seen.resize(values.size());
    const glm::u8vec4* from = picture.data() + static_cast<std::size_t>(first) * width;
    std::uint8_t all = 1;
    for (std::size_t i = 0; i < values.size(); ++i) {
        values[i] = stillLuma(from[i]);
        seen[i] = isSeen(from[i]);
        all &= seen[i];
    }
    allSeen = all != 0;
}

MotionWindow::MotionWindow(int width, int height, int divisor, MotionScore score)
    : width_(width),
      height_(height),
      radius_(std::min(std::min(width, height) / divisor, kLargestSide) / 2),
      score_(score) {}

int MotionWindow::firstNeeded(int first) const {
    return std::max(0, first - radius_);
}

int MotionWindow::rowsNeeded(int first, int rows) const {
    // A gradient looks at the row below.
    return std::min(height_, first + rows + radius_ + 1) - firstNeeded(first);
}

int MotionWindow::pixels(int x, int y) const {
    const auto side = [this](int at, int size) {
        return std::min(at + radius_, size - 1) - std::max(at - radius_, 0) + 1;
    };
    return side(x, width_) * side(y, height_);
}

void MotionWindow::scores(const LumaRows& before, const LumaRows& now, int y,
                          std::uint16_t* to) const {
    const std::uint8_t* a = before.row(y);
    const std::uint8_t* b = now.row(y);
    const int last = width_ - 1;
    if (score_ == MotionScore::luma) {
        for (int x = 0; x < width_; ++x) to[x] = static_cast<std::uint16_t>(std::abs(b[x] - a[x]));
    } else {
        const bool below = y + 1 < height_;
        const std::uint8_t* aBelow = below ? before.row(y + 1) : a;
        const std::uint8_t* bBelow = below ? now.row(y + 1) : b;
        for (int x = 0; x < last; ++x) {
            const int here = b[x] - a[x];
            to[x] = static_cast<std::uint16_t>(std::abs(b[x + 1] - a[x + 1] - here) +
                                               std::abs(bBelow[x] - aBelow[x] - here));
        }
        to[last] =
            static_cast<std::uint16_t>(std::abs(bBelow[last] - aBelow[last] - b[last] + a[last]));
    }
    if (before.allSeen && now.allSeen) return;
    const std::uint8_t* aSeen = before.seenRow(y);
    const std::uint8_t* bSeen = now.seenRow(y);
    for (int x = 0; x < width_; ++x) {
        const int alike = aSeen[x] & bSeen[x], differ = aSeen[x] ^ bSeen[x];
        to[x] = static_cast<std::uint16_t>(to[x] * alike + kMostScore * differ);
    }
}

void MotionWindow::quantities(const LumaRows& before, const LumaRows& now, int first, int rows,
                              std::span<std::uint32_t> to) const {
    const auto width = static_cast<std::size_t>(width_);
    std::vector<std::uint16_t> row(width);
    // Sums over the window's rows of each column, then differences of their running sums: both in
    // whole numbers, which may run over and still differ rightly.
    std::vector<std::uint32_t> columns(width), running(width + 1);
    const auto change = [&](int y, std::uint32_t sign) {
        if (y < 0 || y >= height_) return;
        scores(before, now, y, row.data());
        for (std::size_t x = 0; x < width; ++x) columns[x] += sign * row[x];
    };
    for (int y = first - radius_; y < first + radius_; ++y) change(y, 1u);
    for (int y = first; y < first + rows; ++y) {
        change(y + radius_, 1u);
        for (std::size_t x = 0; x < width; ++x) running[x + 1] = running[x] + columns[x];
        std::uint32_t* out = to.data() + static_cast<std::size_t>(y - first) * width;
        for (int x = 0; x < width_; ++x)
            out[x] = running[static_cast<std::size_t>(std::min(x + radius_, width_ - 1)) + 1] -
                     running[std::max(x - radius_, 0)];
        change(y - radius_, ~0u);
    }
}

}  // namespace stx
