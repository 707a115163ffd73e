#pragma once

#include <optional>
#include <vector>

#include "lib/geometry/pixel_map.hpp"
#include "lib/render/api/extent.hpp"
#include "lib/render/api/frame.hpp"
#include "lib/render/outline/outlines.hpp"
#include "lib/render/scene/glass_pages.hpp"
#include "lib/render/scene/page_set.hpp"

namespace stx {

/// Gives splatted pictures the silhouettes that the references saw. A splat at the rim of an object
/// sticks out by part of a pixel and covers whole pixels. Pixels near the background get the share
/// of their area that lies within the outermost points as coverage (Outlines); where these are too
/// few, the share that no reference sees through: each reference's alpha shows along which rays
/// there is nothing at all. So silhouettes are thin and smooth. Glass (GlassPages) covers what it
/// covers, whatever its alpha is; at its own silhouettes that is kept.
class Silhouettes {
  public:
    /// Views that are covered in full everywhere (full scenes) have no vote and cost nothing.
    explicit Silhouettes(PageSet set);

    /// Whether there is nothing to do for these views.
    [[nodiscard]] bool none() const { return !outlines_; }
    /// Sets alpha, premultiplied colour and albedo of the pixels within two pixels of the
    /// background; what is left with no coverage gets empty. Near glass alpha is the coverage times
    /// that of what is drawn around, and never more than it was. All that was drawn lies in
    /// `drawn`. The same on any number of threads.
    void carve(Frame& frame, const Camera& camera, const Extent& drawn = {});

  private:
    enum class Around : std::uint8_t { mixed, full, empty };
    struct View {
        std::size_t number = 0;
        Camera camera;
        Image<Around> around;  ///< coverage of a pixel and what is next to it
        /// Coverage, 0..255, of a view that is one rectangle; else empty, and asked of the pages.
        Image<std::uint8_t> alpha;
    };
    /// A view that may show glass: a page of it has some.
    struct GlassView {
        std::size_t number = 0;
        Camera camera;
    };
    /// Where the pixels of a picture are in each view.
    using Maps = std::vector<PixelMap>;

    /// Coverage of all pixels of a view, 0..255.
    [[nodiscard]] Image<std::uint8_t> alphaOf(std::size_t number) const;
    /// Coverage of a texel, 0..255.
    [[nodiscard]] float alphaOf(const PageRectangle& r, std::size_t texel) const;
    [[nodiscard]] static Image<Around> aroundOf(const Image<std::uint8_t>& alpha);
    [[nodiscard]] float alphaBilinear(const View& view, double x, double y) const;
    [[nodiscard]] std::uint32_t freeSamples(const Maps& maps, int x, int y, double depth,
                                            std::uint32_t wanted, std::size_t& first) const;
    [[nodiscard]] float coverage(const Camera& camera, const Maps& maps, int x, int y,
                                 const Image<float>& depths, std::size_t& first) const;
    /// Whether some view shows glass where a point of the picture is, or kReach pixels beside it.
    /// `maps`: of glassViews_.
    [[nodiscard]] bool nearGlass(const Maps& maps, int x, int y, double depth) const;

    PageSet set_;
    GlassPages glass_;
    std::vector<GlassView> glassViews_;
    std::optional<Outlines> outlines_;  ///< where some view has a vote
    std::vector<View> views_;
    /// Depths of the frame that is carved; -1 everywhere between two frames.
    Image<float> covered_;
};

}  // namespace stx
