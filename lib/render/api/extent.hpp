#pragma once

#include <algorithm>
#include <limits>

namespace stx {

/// The part of a picture that holds all that was drawn; pixels, x1 and y1 one past the last.
struct Extent {
    int x0 = 0, y0 = 0;
    int x1 = std::numeric_limits<int>::max(), y1 = std::numeric_limits<int>::max();

    /// With so many pixels more on all sides, inside a picture of that size; x1 = x0 if empty.
    [[nodiscard]] Extent grown(int by, int width, int height) const {
        Extent e;
        e.x0 = std::clamp(x0 - by, 0, width);
        e.y0 = std::clamp(y0 - by, 0, height);
        e.x1 = std::clamp(x1 < width ? x1 + by : width, e.x0, width);
        e.y1 = std::clamp(y1 < height ? y1 + by : height, e.y0, height);
        return e;
    }
};

}  // namespace stx
