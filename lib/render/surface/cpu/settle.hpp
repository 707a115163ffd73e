#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "lib/render/surface/cpu/raster.hpp"
#include "lib/render/surface/prepare/votes.hpp"

namespace stx::surface {

/// A tile with one sample in the middle of each pixel, and one pixel around it.
inline constexpr SampleGrid kMiddles{1, 1};
inline constexpr int kMiddlesSide = kTile + 2;

/// What a tile shows in the middles of its pixels, row by row of kPitch; pixel (x, y) of the tile
/// is at (x + 1, y + 1).
struct TileMiddles {
    /// Elements of a row, with room behind it for whole vectors.
    static constexpr int kPitch = kMiddlesSide + 14;
    using Floats = std::array<std::array<float, kPitch>, kMiddlesSide>;
    using Bits = std::array<std::array<std::uint32_t, kPitch>, kMiddlesSide>;
    /// Mean q of the sources that agree on it, 0 = no source has anything there, -1 = they do not
    /// settle it.
    Floats q;
    Floats qx, qy;                             ///< its slope per pixel, of one of those sources
    Bits seenBy;                               ///< bit i: local source i shows it
    Bits alone;                                ///< not 0: only one source shows it
    std::array<std::uint32_t, kTile> settled;  ///< bit x of row y, without `empty`
    std::array<std::uint32_t, kTile> empty;    ///< nothing there nor around
};

/// Finds the pixels of a tile that need no more samples than the one in their middle: they and the
/// pixels around them are simple (see shaders/shared/surface_fuse.glsl) and on one surface, or
/// nothing is in them nor around. `sources` have one sample a pixel, drawn with
/// RasterNeeds::reachFromEdges, the tile's first pixel after an apron of one; rows are `stride`
/// apart. Other pixels would get `perPixel` samples a side.
void settlePixels(std::span<const LocalSource> sources, int stride, const DepthAxis& axis,
                  float step, int perPixel, TileMiddles& out);

}  // namespace stx::surface
