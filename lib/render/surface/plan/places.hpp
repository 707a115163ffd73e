#pragma once

#include <span>
#include <vector>

#include "lib/render/surface/plan/placement.hpp"
#include "lib/render/surface/plan/plan.hpp"

namespace stx::surface {

/// Adds to the sources of each tile those that it cannot do without: of every place that some
/// source shows in the frame, and that nothing hides, the tile gets two sources that show it, or
/// those that there are.
/// `placed`: by source, where its blocks fall. No tile gets more than kMostTileSources.
void addSourcesOfPlaces(SurfaceFrame& frame, std::span<const std::vector<PlacedBlocks>> placed);

}  // namespace stx::surface
