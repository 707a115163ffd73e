#pragma once

#include <cstddef>
#include <cstdint>

#include "lib/geometry/depth_code.hpp"
#include "lib/geometry/pixel_map.hpp"

/// The inner loop of Outlines, compiled for each SIMD target and chosen at run time (Highway).

namespace stx {

inline constexpr int kOutlineBlock = 16;

/// A block of up to kOutlineBlock points along a side.
struct OutlineBlock {
    std::uint32_t rectangle = 0;
    std::uint16_t u0 = 0, v0 = 0, u1 = 0, v1 = 0;  ///< u1 and v1 one past the last
    float zMin = kNoDepth, zMax = 0;               ///< of its points
    std::uint16_t solid[kOutlineBlock] = {};       ///< a bit for each point of a row
};

/// Depths of a rectangle, from its first texel on.
struct OutlineDepths {
    const float* first = nullptr;  ///< null: none
    std::size_t stride = 0;
};

/// A part of a picture in which points tell of outlines. Element (x, y) of the picture is number
/// (y - top + 1) * stride + x - left + 1 of each array: there is a border of one pixel, and two
/// elements more at the right, since four are added to at once.
struct OutlineRows {
    int width = 0, rows = 0, left = 0, top = 0, stride = 0;
    /// What is asked for next to a pixel and there: bit 0 in the row above, 1 in its row, 2 below.
    /// Three bytes after the last may be read.
    const std::uint8_t* near = nullptr;
    const float* outX = nullptr;  ///< out of the object, length 1; NaN where not asked for
    const float* outY = nullptr;
    float* high = nullptr;  ///< outermost and innermost point along that, pixels
    float* low = nullptr;
    float* count = nullptr;  ///< of points
};

/// Adds the points of a block to the pixels around them that are asked for. `m` is the way from the
/// block's rectangle into the picture; `next` is a block that comes later, whose depths are fetched
/// into the cache from `nextDepths`.
void addOutlinePoints(const OutlineBlock& block, const OutlineDepths& depths, const PixelMap& m,
                      bool orthographic, const OutlineBlock& next, const OutlineDepths& nextDepths,
                      const OutlineRows& rows);

}  // namespace stx
