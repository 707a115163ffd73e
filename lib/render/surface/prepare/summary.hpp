#pragma once

#include "lib/model/reference_view.hpp"
#include "lib/model/view_summary.hpp"

namespace stx::surface {

/// What surface mode finds in a view, as far as pictures in which the view has no part hang on it.
[[nodiscard]] ViewSummary summaryOf(const ReferenceView& view);

}  // namespace stx::surface
