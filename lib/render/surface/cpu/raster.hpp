#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

#include "lib/render/surface/prepare/constants.hpp"
#include "lib/render/surface/prepare/source.hpp"

namespace stx::surface {

/// Floats of room after each row of samples, so that whole vectors may be loaded and stored.
inline constexpr int kSamplePadding = 16;

/// The samples of one tile, or of some tiles that lie in a square, and of `apron` pixels around it:
/// `side` x `side`, sample (i, j) at pixel ((i + ½) / S - apron, (j + ½) / S - apron) from the
/// first tile's corner.
struct SampleGrid {
    int perPixel = 1;  ///< S, samples along one side of a pixel
    int apron = 0;
    int pixels = kTile;  ///< along one side, without the apron
    [[nodiscard]] int side() const { return (pixels + 2 * apron) * perPixel; }
    [[nodiscard]] int stride() const { return side() + kSamplePadding; }
    [[nodiscard]] std::size_t count() const { return static_cast<std::size_t>(side()) * stride(); }
};

/// Squares of a tile, kSquare pixels wide: bit 8 y + x.
using Squares = std::uint64_t;
inline constexpr int kSquare = kTile / 8;
inline constexpr Squares kAllSquares = ~Squares{0};
/// Those of columns `left` to `right` and rows `top` to `bottom`, 0 to 7.
[[nodiscard]] inline Squares squaresBetween(int left, int top, int right, int bottom) {
    const Squares columns = (Squares{2} << right) - (Squares{1} << left);
    const Squares rows = (kAllSquares << (8 * top)) & (kAllSquares >> (56 - 8 * bottom));
    return rows & (columns * 0x0101010101010101u);
}

/// The samples that something may be drawn in; nothing where x0 is above x1.
struct DrawnBox {
    float x0 = 1, y0 = 1, x1 = 0, y1 = 0;

    [[nodiscard]] bool empty() const { return !(x0 <= x1 && y0 <= y1); }
    void add(const DrawnBox& other) {
        if (other.empty()) return;
        *this = empty() ? other
                        : DrawnBox{std::min(x0, other.x0), std::min(y0, other.y0),
                                   std::max(x1, other.x1), std::max(y1, other.y1)};
    }
    /// The squares of a tile in which it lies or that it touches by a pixel. The tile's first pixel
    /// is sample (x, y) of a grid with one sample a pixel.
    [[nodiscard]] Squares squaresOf(int x, int y) const;
};

/// What rasteriseSource() may leave out or draw larger.
struct RasterNeeds {
    /// The squares that are asked for; samples of others hold anything afterwards. Only for one
    /// tile without an apron.
    Squares squares = kAllSquares;
    /// Surfaces near an edge of their source reach half a sample farther, so that each pixel that
    /// they touch gets its sample.
    bool reachFromEdges = false;
    /// For each block, gets where it was drawn. May be empty.
    std::span<DrawnBox> drawnIn{};
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
