#pragma once

#include <cstddef>
#include <vector>

#include "lib/base/job.hpp"
#include "lib/model/bundle.hpp"
#include "lib/render/surface/view_surfaces.hpp"

namespace stx {

/// Surfaces of a bundle's views with at most `most` triangles in all, as far as that leaves their
/// holes and parts as they are; each gives up the same share. What is least seen goes first: places
/// move by pixels of the view and by pixels of parallax beside it. Corners stay corners of before,
/// and triangles counter-clockwise seen from their view.
/// Error: cancelled.
[[nodiscard]] Result<void> takeFewerTriangles(const Bundle& bundle, std::size_t most,
                                              std::vector<ViewSurface>& surfaces, Job& job);

}  // namespace stx
