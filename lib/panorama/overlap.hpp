#pragma once

#include <algorithm>

#include "lib/panorama/footprints.hpp"

namespace stx::panorama {

/// Whether two pictures may have cells in common.
[[nodiscard]] inline bool boxesMeet(const Footprint& a, const Footprint& b, int gridWidth) {
    if (a.box.y >= b.box.y + b.box.height || b.box.y >= a.box.y + a.box.height) return false;
    return a.column(b.box.x, gridWidth) >= 0 || b.column(a.box.x, gridWidth) >= 0;
}

/// Calls visit(cell in a, cell in b) for each cell that both see.
template <class Visit>
void shared(const Footprint& a, const Footprint& b, int gridWidth, const Visit& visit) {
    const int top = std::max(a.box.y, b.box.y);
    const int bottom = std::min(a.box.y + a.box.height, b.box.y + b.box.height);
    for (int y = top; y < bottom; ++y)
        for (int x = 0; x < a.box.width; ++x) {
            const int other = b.column(a.box.x + x, gridWidth);
            if (other < 0) continue;
            const glm::ivec2 inA(x, y - a.box.y), inB(other, y - b.box.y);
            if (a.inside.at(inA.x, inA.y) > 0 && b.inside.at(inB.x, inB.y) > 0) visit(inA, inB);
        }
}

/// Light between these is neither noise nor clipped (linear, before gains).
constexpr float kDarkest = 0.003f, kLightest = 0.8f;

}  // namespace stx::panorama
