#pragma once

#include <cstdint>

#include "lib/model/reference_view.hpp"
#include "lib/render/scene/page_set.hpp"

namespace stx {

/// Whether a view has its samples at least twice as close together as another, at any distance from
/// both, or wherever it sees something, as the other does anywhere: PageSet::withoutCoarse() may
/// leave out points of that. Told without pixels.
[[nodiscard]] bool isClearlyFiner(const ViewHeader& view, const ViewHeader& than);

/// The points of a view that others show at least twice as finely: 1 there, else 0. Empty where no
/// other is clearly finer.
[[nodiscard]] Image<std::uint8_t> coarsePoints(const PageSet& set, std::size_t view);

}  // namespace stx
