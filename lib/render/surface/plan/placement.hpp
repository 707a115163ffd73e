#pragma once

#include <vector>

#include "lib/render/surface/plan/plan.hpp"

namespace stx::surface {

/// A range of tiles of a frame; the last ones belong to it.
struct TileRange {
    int x0, y0, x1, y1;
};

/// Where some blocks of a source that lie together fall in a frame.
struct PlacedBlocks {
    TileRange tiles;           ///< all that they may show in
    double q;                  ///< in the frame, of their middle
    std::uint32_t begin, end;  ///< they, in Source::planned
    /// A part of them is behind the camera: their middle may be anywhere.
    bool partlyBehind;
};

/// Where a camera stands in the space of a source's pixels, homogeneous; orthographic: the
/// direction that it is seen in.
[[nodiscard]] glm::dvec4 eyeIn(const Source& s, const Camera& camera);

/// Where all blocks of a source fall, in few pieces.
[[nodiscard]] std::vector<PlacedBlocks> placedBlocks(const FrameSource& f, const TileGrid& tiles);

/// Fills the blocks of a source in a frame of these tiles.
void placeBlocks(FrameSource& f, const PixelSpace& space, const TileGrid& tiles);

}  // namespace stx::surface
