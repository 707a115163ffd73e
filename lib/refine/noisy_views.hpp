#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "lib/base/image.hpp"
#include "lib/geometry/pixel_space.hpp"
#include "lib/model/texture.hpp"

namespace stx {

/// A view whose depth was noisy, after smoothDepth().
struct NoisyView {
    const PixelSpace* space = nullptr;
    const Texture* texture = nullptr;  ///< of the view alone, as large as its depth
    Image<float>* q = nullptr;         ///< as in PreparedPage
    /// Of each point: dq/dx and dq/dy of its surface, and how far off q may be (one standard
    /// deviation, in q).
    Image<glm::vec3> surface;
    float left = 0.0f;  ///< how far off points may be, a share of q; see smoothDepth()
};

/// Where a point of one view is in another, and the surface that the other shows there.
struct ShownSurface {
    bool found = false;
    bool inside = false;  ///< it falls into the other picture
    float u = 0, v = 0;   ///< the point, in pixels of the other view
    float inverse = 0;    ///< one over its homogeneous coordinate there
    float there = 0;      ///< its q there
    float shown = 0;      ///< q of the pixel that it falls on
    float off = 0;        ///< from `there` to the surface of that pixel
    float rate = 0;       ///< by how much `off` falls as the point's own q grows
    float doubt = 0;      ///< how far off that surface may be, in q
};

/// Of a point (x, y, q) of the view whose pixels `warp` leads from into those of `other`.
[[nodiscard]] ShownSurface surfaceShownBy(const NoisyView& other, const Warp& warp, float x,
                                          float y, float q);

/// The mean of the points of a view; without points the place of its camera.
[[nodiscard]] glm::dvec3 middleOf(const NoisyView& view);

/// The views that see the middle of the points of a view most as it does: see nearViews() of
/// geometry.
[[nodiscard]] std::vector<std::size_t> nearViews(std::span<const NoisyView> views,
                                                 std::size_t number, std::size_t most);

/// parallelForBlocks() over the rows of a view that is compared with others: what is in use of a
/// spool, if any, comes from many views, and is given back where it becomes too much.
void forRows(const Image<float>& of, PixelSpool* spool, const std::function<void(int row)>& body);

/// A view that another is compared with.
struct Partner {
    const NoisyView* view;
    Warp warp;  ///< from the pixels of the other
};
/// Those of a view, eight at most: nearViews().
[[nodiscard]] std::vector<Partner> partnersOf(std::span<const NoisyView> views, std::size_t number);

}  // namespace stx
