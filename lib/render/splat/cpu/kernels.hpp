#pragma once

#include <cstddef>
#include <cstdint>

#include "lib/render/splat/block_task.hpp"
#include "lib/render/splat/constants.hpp"

/// The inner loops of splat mode, compiled for each SIMD target and chosen at run time (Highway).

namespace stx::splat {

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
    float largest = kLargest;   ///< largestSplat() of the picture
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
