#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include <glm/glm.hpp>

#include "lib/base/job.hpp"
#include "lib/model/bundle.hpp"
#include "lib/model/view_table.hpp"

namespace stx {

/// The depth image of a view as triangles, for programs that know no depth images.
struct ViewSurface {
    /// Pixels that are corners, and where they are in the world. The texture's coordinates of a
    /// corner are its pixel's centre.
    std::vector<glm::u16vec2> pixels;
    std::vector<glm::vec3> positions;  ///< as long as `pixels`
    /// Three corners each, counter-clockwise seen from the view.
    std::vector<std::uint32_t> triangles;
    /// Points of the view that are on no triangle: what is one pixel thin, or far from all others.
    std::vector<glm::u16vec2> lonePixels;
    std::vector<glm::vec3> lonePositions;  ///< as long as `lonePixels`
    /// Pixels beside an edge whose colour in the view's picture is partly that of the surface
    /// across, and their own colour, 0..1 as the picture's values. Known where their surface is of
    /// nearly one colour.
    std::vector<glm::u16vec2> mixedPixels;
    std::vector<glm::vec3> ownColours;  ///< as long as `mixedPixels`
};

/// Each view of a bundle as a surface, in their order: pixels that surface mode takes as neighbours
/// on one surface are joined, and nothing is joined across an edge; flat parts take fewer
/// triangles, but keep all pixels of their border, so that no gaps open. Pixels that are covered by
/// less than a half are left out. A place that several views show is kept of those that sample it
/// most densely, within a tenth: what a view sees at a grazing angle does not hide what another
/// sees in full. A view with an edge there does not count as showing it, one with a crease there
/// must be much denser, so that no gap opens. Background views come last in that choice.
///
/// One view and a background view from the same place (a photograph and what is behind it): an edge
/// with nothing behind it would be a hole from the side. The background view is whole and joined
/// across all of its edges; the other one where the background shows nothing there, or an eye aside
/// by 8 % of the median distance sees a gap of less than 1.5 pixels.
///
/// Errors: a bundle that fails check(), memory over the limit, cancelled.
[[nodiscard]] Result<std::vector<ViewSurface>> viewSurfaces(const Bundle& bundle, Job& job);
/// The same, each given to `take` in the order of the views while those of later ones are not made
/// yet. `take` may change the colours of that view. `spool`, if any, is that of the bundle, and
/// keeps what is made of its pixels; then no limit is checked. Errors: also those of `take`.
[[nodiscard]] Result<void> forEachSurface(
    const Bundle& bundle, PixelSpool* spool, Job& job,
    const std::function<Result<void>(std::size_t index, ViewSurface surface)>& take);
/// Memory that it takes where the views are in a spool, with what that holds (kSpoolPart), bytes.
[[nodiscard]] std::uint64_t memoryOfSpooledSurfaces(const ViewTable& table);

}  // namespace stx
