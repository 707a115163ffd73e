#pragma once

#include <cstddef>
#include <cstdint>

#include "lib/geometry/pixel_map.hpp"
#include "lib/render/splat/prepared.hpp"

namespace stx::splat {

/// The images of a rectangle, as the loops read them: from its first texel on.
struct RectangleImages {
    const float* depth = nullptr;
    const std::uint8_t* rgba8 = nullptr;  ///< one of rgba8 and rgbaFloat
    const float* rgbaFloat = nullptr;
    const Slope* slopes = nullptr;
    const std::int8_t* normals = nullptr;  ///< four to a pixel; null when not needed
    const std::uint8_t* sizes = nullptr;   ///< null: all 1
    std::uint32_t firstPoint = 0;
    int stride = 0;  ///< texels in a row of the page
    /// Texels of the page before the first one, and from it on: what may be read.
    std::ptrdiff_t before = 0, after = 0;
    bool orthographic = false;
    float fx = 1, fy = 1;
    PixelMap map;
};

/// A block of source pixels in one frame.
struct BlockTask {
    std::uint16_t u0 = 0, v0 = 0, u1 = 0, v1 = 0;
    std::uint32_t source = 0;    ///< number of its rectangle
    std::uint8_t quarters = 15;  ///< to be drawn, as BlockInfo::shownBy counts them, a bit for each
    bool small = true;           ///< every splat closes its gaps within 2x2 pixels
    bool uniform = true;         ///< small, and all share a tilt and go on in colour
    bool opaque = true;
    bool glass = false;  ///< some of its points are glass; else kLinked is all that Slope::u has
    float slopeX = 0,
          slopeY = 0;         ///< relative change of novel depth per output pixel; 0 if not smooth
    float core2 = 0.5f;       ///< squared radius in which a splat hides what is behind, if small
    float tolerance = 0.01f;  ///< relative depth behind the front that still blends
    float quality = 1;        ///< weight among views by the angle between them
    float density = 1;        ///< weight by the density of samples
    /// If uniform: half the source pixels that go by per output pixel, to continue colours with.
    float uAcross = 0, vAcross = 0, uDown = 0, vDown = 0;
    float zMin = 0;       ///< nearest novel depth of its points
    float reach = 1e30f;  ///< its splats reach no farther from their points, pixels
    float nearest = 0;    ///< its splats show nowhere that something nearer than this covers
    std::int32_t x0 = 0, y0 = 0, x1 = 0, y1 = 0;  ///< output pixels it may touch, inclusive
};

}  // namespace stx::splat
