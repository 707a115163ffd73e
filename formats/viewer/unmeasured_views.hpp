#pragma once

#include "lib/base/job.hpp"
#include "lib/model/bundle.hpp"
#include "lib/model/view_table.hpp"

namespace stx {

/// What `stx render` draws behind all views (stage `unmeasured`), as views that a page can hold:
/// pixels of full alpha without depth, with the places that unmeasuredDepth() finds. A camera has
/// up to two: one for pixels that have a place, with the points beside them, and one for those that
/// are far away, since depth of 16 bits that reaches so far would have no steps left for what is
/// near. `all`: the views of one moment, refined. None where no view has such pixels.
[[nodiscard]] Bundle unmeasuredViews(const Bundle& all);

/// Memory that unmeasuredViews() and a page of what it gives take at their peak, with the views
/// themselves, bytes.
[[nodiscard]] std::uint64_t memoryOfUnmeasured(const ViewTable& views);

}  // namespace stx
