#pragma once

#include <cstddef>
#include <functional>
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

}  // namespace stx
