#pragma once

#include <cstddef>
#include <cstdint>

#include "lib/render/splat/constants.hpp"
#include "lib/render/splat/prepared.hpp"

/// The inner loops of splat mode, compiled for each SIMD target and chosen at run time (Highway).

namespace stx::splat {

/// Where the pixels of a source are in the novel view: with (u, v) a pixel's index and z its depth,
/// H = (a0 + au u + av v) z + (b0 + bu u + bv v), and then x = H.x / H.z, y = H.y / H.z (or H.x,
/// H.y when the novel camera is orthographic), novel depth H.z. Pixel centres are whole numbers.
struct PixelMap {
    glm::dvec3 a0, au, av, b0, bu, bv;
};

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

/// The part of the output that one thread owns, with a border of one pixel all around, which is
/// thrown away.
struct Region {
    /// Elements of each array: vectors read past the last row, and splats of up to 4x4 pixels read
    /// and write (what is there already) rows below the border.
    static constexpr std::size_t pixels(int rows, int stride) {
        return static_cast<std::size_t>(rows + 4) * static_cast<std::size_t>(stride) + 64;
    }

    /// The element of pixel (x, y) of the output.
    [[nodiscard]] std::size_t element(int x, int y) const {
        return static_cast<std::size_t>(y - top + 1) * static_cast<std::size_t>(stride) +
               static_cast<std::size_t>(x - left + 1);
    }

    int left = 0, top = 0;      ///< its first pixel in the output
    int width = 0, rows = 0;    ///< pixels
    int stride = 0;             ///< width + 2
    bool orthographic = false;  ///< the novel camera
    float* depth = nullptr;     ///< nearest novel depth; infinity = nothing
    float* colour = nullptr;   ///< four a pixel: weighted sums of R, G, B times alpha, and of alpha
    float* missing = nullptr;  ///< weighted sum of 1 - alpha
    float* normals = nullptr;  ///< four a pixel; null when not needed
    std::uint64_t* points =
        nullptr;  ///< SplatRule::point: depth's bits above, number of the point below
};

/// SplatRule::paper: every splat is round, this many pixels wide at distance 1 (times 1 when the
/// novel camera is orthographic); 0 = SplatRule::data.
struct Shape {
    float coefficient = 0;
};

/// A block that is drawn soon. Its rows are fetched into the cache while another is drawn: memory
/// cannot tell what comes next from rows of 16 pixels that are thousands of bytes apart.
struct Ahead {
    const RectangleImages* source = nullptr;  ///< null: none
    const BlockTask* task = nullptr;
};

/// First pass: nearest depth.
void drawDepth(const RectangleImages& source, const BlockTask& task, const Ahead& ahead,
               const Shape& shape, const Region& region);
/// Second pass: sums of weighted colours (and normals) near the front.
void drawColour(const RectangleImages& source, const BlockTask& task, const Ahead& ahead,
                const Shape& shape, const Region& region);
/// SplatRule::point in one pass.
void drawPoints(const RectangleImages& source, const BlockTask& task, const Region& region);
/// Unit normals of `count` pixels out of the sums of four values each that drawColour() left; zero
/// where nothing was added or `colours` has no alpha.
void resolveNormals(const float* sums, const glm::vec4* colours, std::size_t count, glm::vec3* to);

}  // namespace stx::splat
