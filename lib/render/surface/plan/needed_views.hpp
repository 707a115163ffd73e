#pragma once

#include <span>
#include <vector>

#include "lib/geometry/camera.hpp"
#include "lib/model/reference_view.hpp"
#include "lib/model/view_summary.hpp"
#include "lib/render/api/renderer.hpp"

namespace stx::surface {

/// Whether a view with this header has a summary that says all that pictures need to know of a view
/// which they do not show. Captured, pruned, background and orthographic views have none.
[[nodiscard]] bool tellsWithoutPixels(const ReferenceView& view);

/// Of each view whether some of the pictures may need its pixels: it sees some of what they may
/// show. Of the others nothing is drawn there, they say nothing of it, and where views are chosen
/// their cameras and summaries are enough (`summaries`: one for each view). All views are needed
/// where a summary does not say enough, where views are translucent, and where several have one
/// camera.
[[nodiscard]] std::vector<bool> neededViews(const std::vector<ReferenceView>& views,
                                            std::span<const ViewSummary> summaries,
                                            const RenderSettings& settings,
                                            std::span<const Camera> pictures);

}  // namespace stx::surface
