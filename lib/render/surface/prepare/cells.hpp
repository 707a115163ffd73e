#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "lib/render/surface/prepare/constants.hpp"
#include "lib/render/surface/prepare/source.hpp"

namespace stx::surface {

/// The diagonal of a cell along which depth changes less.
[[nodiscard]] inline std::uint32_t splitOf(float q00, float q10, float q01, float q11) {
    return std::abs(q00 - q11) < std::abs(q10 - q01) ? kFallingSplit : kRisingSplit;
}

/// How the cell between a pixel (i, j) of a block and its right and lower neighbours is drawn when
/// it is in no leaf: kNoCell, or kQuadCell and the shapes after it.
[[nodiscard]] inline std::uint32_t cellShape(const Source& s, const BlockTexels& t, int i, int j) {
    const std::uint8_t here = t.info[t.at(i, j)];
    const bool top = here & Info::kLinkRight, bottom = t.info[t.at(i, j + 1)] & Info::kLinkRight;
    const bool left = here & Info::kLinkDown, right = t.info[t.at(i + 1, j)] & Info::kLinkDown;
    const int links = top + bottom + left + right;
    if (links >= 3) {
        const float q00 = t.q[t.at(i, j)], q10 = t.q[t.at(i + 1, j)];
        const float q01 = t.q[t.at(i, j + 1)], q11 = t.q[t.at(i + 1, j + 1)];
        if (links == 4 &&
            std::abs(q00 + q11 - q10 - q01) <= 2 * s.flat * s.space.axis.relativeScale(q00))
            return kQuadCell;
        return splitOf(q00, q10, q01, q11);
    }
    if (top && left) return kUpperLeft;
    if (top && right) return kUpperRight;
    if (bottom && right) return kLowerRight;
    if (bottom && left) return kLowerLeft;
    return kNoCell;
}

/// Whether a corner of that cell is within two pixels of an edge.
[[nodiscard]] inline bool cellNearEdge(const BlockTexels& t, int i, int j) {
    const auto distance = [&](int di, int dj) { return t.info[t.at(i + di, j + dj)] >> 4; };
    return std::min(std::min(distance(0, 0), distance(1, 0)),
                    std::min(distance(0, 1), distance(1, 1))) < 3;
}

}  // namespace stx::surface
