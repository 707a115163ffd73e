#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "lib/render/surface/cpu/raster.hpp"
#include "lib/render/surface/cpu/settle.hpp"
#include "lib/render/surface/plan/plan.hpp"
#include "lib/render/surface/prepare/votes.hpp"

namespace stx::surface {

/// Parts of surfaces to shade, one per pixel and depth, as arrays of equal length.
struct Pieces {
    std::vector<float> x, y;             ///< frame pixel position of the part's middle
    std::vector<float> q, qx, qy;        ///< depth and its slope per pixel
    std::vector<float> share;            ///< of the pixel, 0..1
    std::vector<std::uint32_t> sources;  ///< bit i: local source i sees it
    std::vector<std::uint16_t> pixel;    ///< column + kTile * row in the tile

    void clear();
    /// Adds a piece with the part `of` (0..1) of its share.
    void add(const Piece& piece, float of);
    void resize(std::size_t size);
    [[nodiscard]] std::size_t size() const { return x.size(); }
};

/// Those of the tile whose first pixel is (tileX, tileY) that are in a frame of this size.
[[nodiscard]] TilePixels pixelsInFrame(int tileX, int tileY, int width, int height);

/// Decides what each pixel of a tile shows: fuses the surfaces of the sources, checked against what
/// the others see. At most 32 sources, at most 4 samples a side. Pixels that are not simple (see
/// shaders/shared/surface_fuse.glsl) are the mean of that and of what the first `core` sources
/// show. Of `wanted` pixels only; samples of others need not be there, except beside those.
void fuseTile(std::span<const LocalSource> sources, const SampleGrid& grid, const DepthAxis& axis,
              int tileX, int tileY, const TilePixels& wanted, Pieces& pieces,
              int core = kMostTileSources);

/// Adds the pieces of those `wanted` pixels that one sample in their middle settles; `sources` have
/// samples of such a grid, the tile's first pixel after the apron (see settlePixels()). Returns the
/// others, where that does not tell; those would get `perPixel` samples a side.
[[nodiscard]] TilePixels fuseSettled(std::span<const LocalSource> sources, const SampleGrid& grid,
                                     const DepthAxis& axis, int tileX, int tileY,
                                     const TilePixels& wanted, int perPixel, Pieces& pieces);

}  // namespace stx::surface
