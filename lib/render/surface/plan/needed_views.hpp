#pragma once

#include <span>
#include <vector>

#include "lib/geometry/camera.hpp"
#include "lib/model/reference_view.hpp"
#include "lib/model/view_summary.hpp"
#include "lib/render/api/renderer.hpp"

namespace stx::surface {

/// Whether such a view, by its header, has a summary that tells what pictures hang on: not of
/// captured, pruned, background and orthographic ones.
[[nodiscard]] bool tellsWithoutPixels(const ReferenceView& view);

/// Of each view whether it may have a part in one of some pictures: it sees some of what they may
/// show. The others draw nothing there, tell nothing of it, and no choice among views hangs on
/// them but by their cameras and summaries (`summaries`: one for each view). All, where one of
/// these does not tell, and of translucent views and several with one camera.
[[nodiscard]] std::vector<bool> neededViews(const std::vector<ReferenceView>& views,
                                            std::span<const ViewSummary> summaries,
                                            const RenderSettings& settings,
                                            std::span<const Camera> pictures);

}  // namespace stx::surface
