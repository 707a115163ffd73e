#pragma once

#include <vector>

#include <glm/glm.hpp>

#include "lib/base/result.hpp"

namespace stx {

/// Bounds of a packing.
struct RectangleLimits {
    int maxSize = 16384;  ///< largest width and height of a page, pixels, 1..65535
    int maxPages = 1;     ///< >= 1
    bool mayTurn = true;  ///< quarter turns, taken only when the pages get smaller by them
    /// Of each page, exactly; {0, 0}: the smallest within maxSize.
    glm::ivec2 size{0};
    bool powerOfTwo = false;  ///< of width and height of a page, where they are free
    /// Largest page, where one side may be longer than the other; {0, 0}: maxSize both ways.
    glm::ivec2 maxPage{0};
};

/// Where one rectangle went.
struct RectanglePlace {
    int page = 0;
    int x = 0, y = 0;  ///< top left corner, pixels
    bool turned = false;

    bool operator==(const RectanglePlace&) const = default;
};

struct RectanglePacking {
    int width = 0, height = 0;  ///< of each page, pixels
    int pages = 1;
    std::vector<RectanglePlace> places;  ///< one per size given
};

/// Packs rectangles of the given sizes (each at least 1x1) into the smallest page found, or into
/// the fewest pages of one size when one is not enough. A skyline is filled from its lowest gap
/// with the rectangle that suits the gap; page widths, orders and rules of choice are searched,
/// then the best are improved step by step. The work is bounded, the result depends on nothing but
/// the sizes: their order only says which of two equal rectangles is which.
///
/// Errors (invalidInput): a size out of range, or more than the pages hold, with a size that would
/// do.
[[nodiscard]] Result<RectanglePacking> packRectangles(const std::vector<glm::ivec2>& sizes,
                                                      const RectangleLimits& limits);

}  // namespace stx
