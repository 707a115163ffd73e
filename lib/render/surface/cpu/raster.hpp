#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>

#include "lib/render/surface/constants.hpp"
#include "lib/render/surface/source.hpp"

namespace stx::surface {

/// Floats of room after each row of samples, so that whole vectors may be loaded and stored.
inline constexpr int kSamplePadding = 16;

/// The samples of one tile: `side` x `side`, sample (i, j) at tile pixel ((i + ½) / S, (j + ½) /
/// S).
struct SampleGrid {
    int perPixel = 1;  ///< S, samples along one side of a pixel
    [[nodiscard]] int side() const { return kTile * perPixel; }
    [[nodiscard]] int stride() const { return side() + kSamplePadding; }
    [[nodiscard]] std::size_t count() const { return static_cast<std::size_t>(side()) * stride(); }
};

/// How the cell between a pixel and its right and lower neighbours is drawn when it is in no leaf:
/// kNoCell, or kQuadCell and the shapes after it.
[[nodiscard]] inline std::uint32_t cellShape(const Source& s, int x, int y) {
    const bool top = s.linkRight(x, y), bottom = s.linkRight(x, y + 1);
    const bool left = s.linkDown(x, y), right = s.linkDown(x + 1, y);
    const int links = top + bottom + left + right;
    if (links >= 3) {
        const float q00 = s.q.at(x, y), q10 = s.q.at(x + 1, y);
        const float q01 = s.q.at(x, y + 1), q11 = s.q.at(x + 1, y + 1);
        if (links == 4 && std::abs(q00 + q11 - q10 - q01) <= 2 * s.flat * s.space.axis.whole(q00))
            return kQuadCell;
        return std::abs(q00 - q11) < std::abs(q10 - q01) ? kFallingSplit : kRisingSplit;
    }
    if (top && left) return kUpperLeft;
    if (top && right) return kUpperRight;
    if (bottom && right) return kLowerRight;
    if (bottom && left) return kLowerLeft;
    return kNoCell;
}

/// Whether a corner of that cell is within two pixels of an edge.
[[nodiscard]] inline bool cellNearEdge(const Source& s, int x, int y) {
    return std::min(std::min(s.edgeDistance(x, y), s.edgeDistance(x + 1, y)),
                    std::min(s.edgeDistance(x, y + 1), s.edgeDistance(x + 1, y + 1))) < 3;
}

/// Draws blocks of one source as a surface into a tile: the nearest q at each sample, 0 where the
/// source has nothing, with kSampleFlags in its lowest bits. Surfaces seen from behind are left
/// out. `sampleFromSource` maps source pixel positions to sample indices; q beyond `qLimit` is cut
/// off.
void rasteriseSource(const Source& source, const Warp& sampleFromSource,
                     std::span<const std::uint32_t> blocks, const SampleGrid& grid, float qLimit,
                     float* samples);

/// The SIMD target in use, as Highway names it.
[[nodiscard]] const char* simdTarget();

}  // namespace stx::surface
