#pragma once

#include <cstdint>
#include <span>

#include "lib/render/surface/prepare/constants.hpp"
#include "lib/render/surface/prepare/source.hpp"

namespace stx::surface {

/// Floats of room after each row of samples, so that whole vectors may be loaded and stored.
inline constexpr int kSamplePadding = 16;

/// The samples of one tile and of `apron` pixels around it: `side` x `side`, sample (i, j) at tile
/// pixel ((i + ½) / S - apron, (j + ½) / S - apron).
struct SampleGrid {
    int perPixel = 1;  ///< S, samples along one side of a pixel
    int apron = 0;
    [[nodiscard]] int side() const { return (kTile + 2 * apron) * perPixel; }
    [[nodiscard]] int stride() const { return side() + kSamplePadding; }
    [[nodiscard]] std::size_t count() const { return static_cast<std::size_t>(side()) * stride(); }
};

/// Squares of a tile, kSquare pixels wide: bit 8 y + x.
using Squares = std::uint64_t;
inline constexpr int kSquare = kTile / 8;
inline constexpr Squares kAllSquares = ~Squares{0};

/// What rasteriseSource() may leave out or draw larger.
struct RasterNeeds {
    /// The squares that are asked for; samples of others hold anything afterwards. Only for tiles
    /// without an apron.
    Squares squares = kAllSquares;
    /// Surfaces near an edge of their source reach half a sample farther, so that each pixel that
    /// they touch gets its sample.
    bool reachFromEdges = false;
    /// With kMiddles: for each block, gets the squares that the block may be drawn in, with those a
    /// pixel around. May be empty.
    std::span<Squares> drawnIn{};
    /// `drawnIn` of an earlier call: blocks that lie in no square that is asked for are left out.
    /// May be empty.
    std::span<const Squares> of{};
};

/// Draws blocks of one source as a surface into a tile: the nearest q at each sample, 0 where the
/// source has nothing, with kSampleFlags in its lowest bits. Surfaces seen from behind are left
/// out. `sampleFromSource` maps source pixel positions to sample indices; q beyond
/// axis.nearest() is cut off; `axis` is that of the frame. False when nothing of it shows there:
/// then `samples` are left as they were.
[[nodiscard]] bool rasteriseSource(const Source& source, const Warp& sampleFromSource,
                                   std::span<const std::uint32_t> blocks, const SampleGrid& grid,
                                   const DepthAxis& axis, float* samples,
                                   const RasterNeeds& needs = {});

}  // namespace stx::surface
