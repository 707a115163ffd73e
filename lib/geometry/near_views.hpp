#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "lib/geometry/camera.hpp"

namespace stx {

/// Up to `most` of `count` views that see a place in the world from directions that are most like
/// that of view `number`, the most alike first; `camera(i)` is that of view i. Where directions are
/// the same, as of parallel orthographic views, those whose cameras are nearest come first. Views
/// that have the place behind them, or see it from the other side, are left out, and so is
/// `number`.
[[nodiscard]] std::vector<std::size_t> nearViews(
    std::size_t count, const std::function<const Camera&(std::size_t)>& camera, std::size_t number,
    const glm::dvec3& place, std::size_t most);

/// Others than view `number` that tell where surfaces of a place in the world end: all, in their
/// order, where they are `most` at most. Else `most` of those that have the place in front, which
/// look from directions as different from each other and from that of the view as can be; opposite
/// ones are the same, since they show the same outline. Those in whose pictures the place is come
/// first.
[[nodiscard]] std::vector<std::size_t> viewsAround(
    std::size_t count, const std::function<const Camera&(std::size_t)>& camera, std::size_t number,
    const glm::dvec3& place, std::size_t most);

/// A sphere around what a view shows, in the world.
struct ShownSphere {
    glm::dvec3 centre{0.0};
    double radius = 0;

    /// Around points, their mean in its middle.
    [[nodiscard]] static ShownSphere around(std::span<const glm::dvec3> points);
};

/// Others than view `number` that may show some of what it shows, in their order: all where they
/// are `most` at most, else nearViews() of those in whose pictures some of the sphere may be.
[[nodiscard]] std::vector<std::size_t> viewsThatMayShow(
    std::size_t count, const std::function<const Camera&(std::size_t)>& camera, std::size_t number,
    const ShownSphere& shown, std::size_t most);

/// Of many views each is compared with so many others at most, so that time does not grow with the
/// square of their number.
inline constexpr std::size_t kMostCompared = 64;
/// For each view those that are to look for it: of which it is one of viewsThatMayShow(), with
/// kMostCompared; in their order.
[[nodiscard]] std::vector<std::vector<std::size_t>> viewsToLookFor(
    std::size_t count, const std::function<const Camera&(std::size_t)>& camera,
    const std::function<ShownSphere(std::size_t)>& shown);

}  // namespace stx
