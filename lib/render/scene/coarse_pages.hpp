#pragma once

#include "lib/model/reference_view.hpp"

namespace stx {

/// Whether a view has its samples at least twice as close together as another, at any distance from
/// both, or wherever it sees something, as the other does anywhere: PageSet::withoutCoarse() may
/// leave out points of that. Told without pixels.
[[nodiscard]] bool isClearlyFiner(const ViewHeader& view, const ViewHeader& than);

}  // namespace stx
