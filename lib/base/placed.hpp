#pragma once

#include <algorithm>
#include <cstddef>

#include <glm/glm.hpp>

namespace stx {

/// Copies a part, row by row, into a picture in which its first pixel is at `at`; what reaches
/// beyond it is left out. Of each pixel `each` values, `whole` has those of wholeSize pixels.
template <class T>
void place(const T* part, glm::ivec2 size, glm::ivec2 at, T* whole, glm::ivec2 wholeSize,
           int each = 1) {
    const int from = std::max(0, -at.x), end = std::min(size.x, wholeSize.x - at.x);
    if (from >= end) return;
    const auto indexOf = [&](int x, int y, int width) {
        return (static_cast<std::size_t>(y) * width + x) * each;
    };
    for (int y = std::max(0, -at.y); y < std::min(size.y, wholeSize.y - at.y); ++y)
        std::copy_n(part + indexOf(from, y, size.x), static_cast<std::size_t>(end - from) * each,
                    whole + indexOf(from + at.x, y + at.y, wholeSize.x));
}

}  // namespace stx
