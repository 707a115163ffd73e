#pragma once

#include <algorithm>

#include "lib/base/image.hpp"

namespace stx {

/// A picture of this size in which `part` lies with its first pixel at `at`, cut where it reaches
/// beyond; `nothing` is where it is not.
template <class P>
[[nodiscard]] Image<P> placed(const Image<P>& part, glm::ivec2 at, glm::ivec2 size, P nothing) {
    Image<P> whole(size.x, size.y, nothing);
    const int from = std::max(0, -at.x), end = std::min(part.width(), size.x - at.x);
    for (int y = std::max(0, -at.y); y < std::min(part.height(), size.y - at.y); ++y)
        for (int x = from; x < end; ++x) whole.at(x + at.x, y + at.y) = part.at(x, y);
    return whole;
}

}  // namespace stx
