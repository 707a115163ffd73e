#pragma once

#include <cstdint>
#include <vector>

#include "lib/render/frame.hpp"
#include "lib/render/scene/page_set.hpp"
#include "lib/render/splat/cpu/kernels.hpp"

namespace stx {

/// Where the outline of an object runs through the pixels beside it, to a fraction of a pixel: no
/// point of any view lies beyond it. Splats reach beyond it by part of a pixel. Where a surface
/// turns away points come as near to the outline as one likes, since views that look from beside
/// see it from the front; at creases and rims as near as one of many views comes.
class Outlines {
  public:
    /// A pixel that is asked for, in `covered`.
    static constexpr float kAsked = -2.0f;

    /// Points are those with an alpha of at least one half.
    explicit Outlines(PageSet set);

    /// Replaces those values of `covered` that are kAsked by the share of the pixel's area that is
    /// covered, 0..1, where so many points lie around it that their outermost tell. `covered` has
    /// the frame's size; pixels that are asked for must be near the background, which is where
    /// `frame` has no depth. The same on any number of threads.
    void measure(const Frame& frame, const Camera& camera, Image<float>& covered) const;

  private:
    static constexpr int kBlockSide = 16;
    struct Block {
        std::uint32_t rectangle = 0;
        std::uint16_t u0 = 0, v0 = 0, u1 = 0, v1 = 0;  ///< u1 and v1 one past the last
        float zMin = kNoDepth, zMax = 0;               ///< of its points
        std::uint16_t solid[kBlockSide] = {};          ///< a bit for each point of a row
    };
    struct Band;

    static void addToRow(Band& band, std::size_t first, float dx, float dy);
    void addPoints(const Block& block, const splat::PixelMap& m, bool orthographic,
                   const Block* ahead, Band& band) const;

    PageSet set_;
    std::vector<Block> blocks_;
};

}  // namespace stx
