#pragma once

#include <span>

#include "lib/model/bundle.hpp"

namespace stx {

/// Whether takeCoarseAway() may change views of one moment. Needs no pixels.
[[nodiscard]] bool mayHaveCoarse(std::span<const ReferenceView> views);

/// Takes away the points that other views show at least twice as finely, and views that have no
/// others, as splat mode of stx render does (stage `coarse`): large splats stick out beyond
/// outlines that finer views know.
void takeCoarseAway(Bundle& bundle);

}  // namespace stx
