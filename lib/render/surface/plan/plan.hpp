#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include "lib/geometry/bounds.hpp"
#include "lib/render/api/renderer.hpp"
#include "lib/render/surface/prepare/source.hpp"

namespace stx::surface {

/// Three affine functions of (x, y, q): the vector from an eye to the point, up to a positive
/// scale.
using Ray = std::array<float, 12>;

/// The vector from a camera's eye to the point (x, y, q) of a frame (orthographic: along its axis).
[[nodiscard]] Ray rayFrom(const PixelSpace& eye, const PixelSpace& frame);

/// How colours are fitted; see shadePieces(). Chosen by trial on the project's image sets.
struct ShadeSettings {
    int mostSources = 4;   ///< sources that one piece takes colours from
    float kernel = 3.5f;   ///< squared radius of the fit, target pixels
    float ridge = 0.006f;  ///< holds the linear and quadratic terms down
    /// Weight of pixels on edges and creases of a source, 0..1; it grows to 1 until kEdgeFade away.
    float edgeWeight = kEdgeWeight;
};

/// What a quality means for a scene; chosen by trial on the project's image sets.
struct Effort {
    int samplesPerPixel = 4;  ///< along one side of a pixel
    int mostGeometry = 8;     ///< sources that one tile is built from, at most kMostTileSources
    /// So many more, with which it is built a second time: the picture is the mean of both.
    int moreGeometry = 0;
    float freeLevel = kFreeLevel;
    /// Of many sources those that have something in a tile come first: pruned views.
    bool preferShown = false;
    bool places = true, mean = true, settle = true;  ///< stages
    ShadeSettings shade;
};
[[nodiscard]] Effort effortOf(const RenderSettings& settings, const SurfaceScene& scene);

/// One source in one frame: its maps and, of sources that tiles are built from, which blocks may
/// show in which tile.
struct FrameSource {
    const Source* source = nullptr;
    Warp sourceFromPixel;
    glm::dmat4 pixelFromSource{1.0};
    Ray fromEye{};
    /// Tile t has blocks[tileBegin[t] .. tileBegin[t + 1]); empty when no tile is built from it.
    std::vector<std::uint32_t> tileBegin;
    std::vector<std::uint32_t> blocks;
    /// By block of the source: not 0 where all of it is seen from behind, which draws nothing.
    std::vector<std::uint8_t> turnedAway;

    [[nodiscard]] std::span<const std::uint32_t> blocksOf(int tile) const {
        if (tileBegin.empty()) return {};
        const auto t = static_cast<std::size_t>(tile);
        return {blocks.data() + tileBegin[t], tileBegin[t + 1] - tileBegin[t]};
    }
};

/// Some pixels of a tile: bit x of row y.
using TilePixels = std::array<std::uint32_t, kTile>;

/// The tiles of a frame, of kTile x kTile pixels, row by row. One begins at the principal point: a
/// part of a frame has the tiles of the whole, which choose the same sources.
struct TileGrid {
    glm::ivec2 first{0};  ///< first pixel of the first tile: -kTile + 1 to 0
    glm::ivec2 size{0};   ///< tiles
    explicit TileGrid(const Camera& camera);
    TileGrid() = default;
    [[nodiscard]] int count() const { return size.x * size.y; }
    /// The first pixel of a tile; those of the first ones may lie before the frame.
    [[nodiscard]] int x(int tile) const { return first.x + tile % size.x * kTile; }
    [[nodiscard]] int y(int tile) const { return first.y + tile / size.x * kTile; }
    /// The tile of a pixel of the frame.
    [[nodiscard]] int at(glm::ivec2 pixel) const {
        const glm::ivec2 tile = (pixel - first) / kTile;
        return tile.y * size.x + tile.x;
    }
};

/// A frame to draw.
struct SurfaceFrame {
    PixelSpace space;
    std::vector<FrameSource> sources;
    TileGrid tiles;
    /// By tile: the sources that it is built from, at most kMostTileSources; none where no source
    /// has anything.
    std::vector<std::vector<int>> tileSources;
    /// By tile: so many of them, the first, tell what it shows by themselves, too: the picture is
    /// the mean of that and of what all of them show. Those come in order, and so do the others.
    std::vector<int> tileCore;
    /// By tile: the pixels that are wanted; empty: all are. Of a tile with some a backend may draw
    /// more.
    std::vector<TilePixels> wanted;
    Effort effort;
    bool wantOrigin = false;  ///< see DrawnFrame::origin

    [[nodiscard]] const std::vector<int>& sourcesOf(int tile) const {
        return tileSources[static_cast<std::size_t>(tile)];
    }
    /// Samples of a tile from pixels of the frame: what is `apron` pixels before the tile's corner
    /// to the origin, `perPixel` to the pixel, the first sample at ½.
    [[nodiscard]] glm::dmat4 sampleFromPixel(int tile, int perPixel, int apron = 0) const;
    /// Surfaces with a larger q are behind the camera.
    [[nodiscard]] float qLimit() const;
};

/// Leaves out what is not wanted, by tile.
void keepPixels(SurfaceFrame& frame, std::vector<TilePixels> wanted);

/// World bounds of all blocks of all sources.
[[nodiscard]] Bounds boundsOf(const SurfaceScene& scene);

/// Places all sources of a scene, whose bounds are given, in a camera's frame.
[[nodiscard]] SurfaceFrame planFrame(const SurfaceScene& scene, const Bounds& bounds,
                                     const Effort& effort, const Camera& camera);

}  // namespace stx::surface
