#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "lib/render/surface/cpu/raster.hpp"
#include "lib/render/surface/votes.hpp"

namespace stx::surface {

/// Parts of surfaces to shade, one per pixel and depth, as arrays of equal length.
struct Pieces {
    std::vector<float> x, y;             ///< frame pixel position of the part's middle
    std::vector<float> q, qx, qy;        ///< depth and its slope per pixel
    std::vector<float> share;            ///< of the pixel, 0..1
    std::vector<std::uint32_t> sources;  ///< bit i: local source i sees it
    std::vector<std::uint16_t> pixel;    ///< column + kTile * row in the tile

    void clear();
    void add(const Piece& piece);
    [[nodiscard]] std::size_t size() const { return x.size(); }
};

/// Decides what each pixel of a tile shows: fuses the surfaces of the sources, checked against what
/// the others see. At most 32 sources, at most 4 samples a side.
void fuseTile(std::span<const LocalSource> sources, const SampleGrid& grid, const DepthAxis& axis,
              int tileX, int tileY, int columns, int rows, Pieces& pieces);

}  // namespace stx::surface
