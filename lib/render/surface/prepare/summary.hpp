#pragma once

#include "lib/model/reference_view.hpp"
#include "lib/model/view_summary.hpp"

namespace stx::surface {

/// What surface mode finds in a view, as far as pictures in which the view has no part hang on it.
[[nodiscard]] ViewSummary summaryOf(const ReferenceView& view);

/// False where a summary is not that of a view: another number of points, pixels that are not
/// covered in full or not, points beyond its bounds or farther than it says. A look at each pixel,
/// without summaryOf()'s preparing, which takes as long as to prepare the view for drawing.
[[nodiscard]] bool mayBeSummaryOf(const ViewSummary& summary, const ReferenceView& view);

}  // namespace stx::surface
