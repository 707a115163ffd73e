#pragma once

#include <cstdint>

#include "lib/model/peak_memory.hpp"
#include "lib/model/view_table.hpp"

namespace stx::tools {

/// checkPeak() of all views of a table in memory, before they are read: pixels without a point
/// count in full.
[[nodiscard]] Result<void> checkPeakOfAll(const PeakMemory& step, const ViewTable& views,
                                          const Limits& limits);

/// Error (invalidInput) where not even the images of all views fit into the limit. It names what a
/// step on them takes, not what they take, so that the limit that it names is enough for both.
/// `fromSpool`: what the step takes with the views in a spool, where it can; the less is named.
[[nodiscard]] Result<void> checkImagesFit(const PeakMemory& step, const ViewTable& views,
                                          const Limits& limits,
                                          std::uint64_t fromSpool = UINT64_MAX);

}  // namespace stx::tools
