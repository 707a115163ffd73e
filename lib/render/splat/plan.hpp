#pragma once

#include "lib/geometry/pixel_space.hpp"
#include "lib/render/splat/block_task.hpp"

namespace stx::splat {

/// What to do for one block in one frame. False when nothing of it can be seen: it lies outside, or
/// all of it faces away (only where `cullBackFaces`). `shares`: of the novel camera.
[[nodiscard]] bool planBlock(const PreparedRectangle& rectangle, const BlockInfo& block,
                             const RectangleImages& source, const Camera& novel,
                             const ShareLength& shares, bool cullBackFaces, BlockTask& task);

/// How far splats of a picture reach from their points at most, pixels (kLargest, kLargestShare).
/// Orthographic pictures show a plane as it is, however close it is: no end.
[[nodiscard]] float largestSplat(const Camera& novel);

}  // namespace stx::splat
