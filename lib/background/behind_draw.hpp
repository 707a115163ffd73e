#pragma once

#include <cstdint>

#include "lib/background/behind_patches.hpp"
#include "lib/model/reference_view.hpp"

namespace stx::behind {

/// Draws what was invented in blocks into new images of `out`, whose camera has the size of the
/// photograph with its border: smooth colours, and on them the fine detail of the photograph at
/// `sources`. Gives the number of pixels inside of the photograph's frame. `scale`: parallax times
/// distance.
[[nodiscard]] std::int64_t drawBehind(const Layer& layer, const Sources& sources,
                                      const ReferenceView& photo, double scale, ReferenceView& out);

}  // namespace stx::behind
