#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

/// The inner loops of drawing splats, compiled for each SIMD target and chosen at run time
/// (Highway).

namespace stx::splats {

/// Pictures are drawn in square tiles of this side, pixels.
inline constexpr int kTile = 16;
inline constexpr int kTilePixels = kTile * kTile;

/// A splat in the picture.
struct Projected {
    float x, y;  ///< its centre, pixels
    /// Factor of the inverse of its covariance, per pixel: at (dx, dy) from the centre are
    /// (xx dx + xy dy)^2 + (yy dy)^2 squared deviations. Products of the inverse itself would
    /// cancel in floats along a splat that is a thousand times longer than wide.
    float xx, xy, yy;
    float cut;           ///< squared deviations beyond which it is not drawn
    float halfX, halfY;  ///< of the box of what is drawn, pixels
    float opacity;       ///< at its centre
    float red, green, blue;
    std::uint32_t number;  ///< in the cloud
};

/// What the splats of a tile came to so far, pixel by pixel, row by row.
struct alignas(64) TilePixels {
    std::array<float, kTilePixels> transmittance, red, green, blue;
    /// The place in the list of splats of the one at which the transmittance fell below one half;
    /// -1 = none yet.
    std::array<std::int32_t, kTilePixels> median;
};

/// Blends splats, nearest first, into the tile whose first pixel is (left, top).
void blendTile(const Projected* splats, const std::uint32_t* order, std::size_t count, int left,
               int top, TilePixels& pixels);

/// Adds to `colour` (three values) the harmonics of a splat (SplatCloud::harmonics) in the
/// direction whose `basis` is given; `padded` values of each.
void addHarmonics(const std::uint16_t* harmonics, int padded, const float* basis, float* colour);

}  // namespace stx::splats
