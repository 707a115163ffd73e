#pragma once

#include <cstddef>

#include "lib/model/atlas.hpp"
#include "lib/model/reference_view.hpp"

namespace stx {

/// The median planar distance of what a view shows, scene units; 0 where it shows nothing.
[[nodiscard]] double medianDistance(const ReferenceView& view);
/// The same of a view of an atlas; of a pruned one, what is left of it.
[[nodiscard]] double medianDistance(const Atlas& atlas, std::size_t view);

}  // namespace stx
