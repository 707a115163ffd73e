#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <glm/vec2.hpp>

#include "lib/base/for_where.hpp"
#include "lib/render/api/extent.hpp"
#include "lib/render/api/frame.hpp"
#include "lib/render/outline/outline_points.hpp"
#include "lib/render/scene/glass_pages.hpp"
#include "lib/render/scene/page_set.hpp"

namespace stx {

/// Which way is out of the object at a pixel near the background, which is where `depth` has no
/// point; length 1, or zero where what is around has no direction.
[[nodiscard]] glm::vec2 outwardAt(const Image<float>& depth, int x, int y);

/// Where the outline of an object runs through the pixels beside it, to a fraction of a pixel: no
/// point of any view lies beyond it. Splats reach beyond it by part of a pixel. Where a surface
/// turns away points come as near to the outline as one likes, since views that look from beside
/// see it from the front; at creases and rims as near as one of many views comes.
class Outlines {
  public:
    /// A pixel that is asked for, in `covered`.
    static constexpr float kAsked = -2.0f;

    /// Points are those with an alpha of at least one half, and those of which `glass`, if any,
    /// covers as much. It is of the same set, and not kept.
    explicit Outlines(PageSet set, const GlassPages* glass = nullptr);
    Outlines(Outlines&&) noexcept;
    ~Outlines();

    /// Replaces those values of `covered` that are kAsked by the share of the pixel's area that is
    /// covered, 0..1, where so many points lie around it that their outermost tell. `covered` has
    /// the frame's size; pixels that are asked for must be near the background, which is where
    /// `frame` has no depth, and lie in `part`. The same on any number of threads. Of one frame at
    /// a time: what it measures in is kept for the next.
    void measure(const Frame& frame, const Camera& camera, Image<float>& covered,
                 const Extent& part = {});

  private:
    struct Side;
    struct Band;

    [[nodiscard]] OutlineDepths depthsOf(const OutlineBlock& block) const;
    /// By view: 1 for those whose points are asked about what bands_ have.
    [[nodiscard]] std::vector<std::uint8_t> askedViews(const Camera& camera) const;
    /// Begins band `n`: the pixels of `part` that `covered` asks for, and which way is out there;
    /// marks their tiles. With `sides` it notes the sides of the object that they are on.
    void beginBand(std::size_t n, const Frame& frame, const Camera& camera,
                   const Image<float>& covered, const Extent& part, bool sides,
                   Image<std::uint8_t>& tiles);
    /// Gives each band the blocks of views in `asked` (empty: of all) that may have points in its
    /// marked tiles.
    void findBlocks(const Camera& camera, const std::vector<PixelMap>& maps,
                    const std::vector<std::uint8_t>& asked, const Image<std::uint8_t>& tiles,
                    glm::ivec2 size);
    /// Adds the points of its blocks to band `n`, and writes what they measure.
    void measureBand(std::size_t n, const Camera& camera, const std::vector<PixelMap>& maps,
                     Image<float>& covered);

    PageSet set_;
    std::vector<OutlineBlock> blocks_;
    std::vector<Band> bands_;
};

}  // namespace stx
