#pragma once

#include <span>
#include <vector>

#include "lib/base/image.hpp"
#include "lib/refine/refine_depth.hpp"

namespace stx {

/// Where pixels are that a sensor has colours but no depth of.
struct UnmeasuredDepth {
    /// Of each view: distances of those pixels, and of the points beside them; kNoDepth elsewhere.
    /// Empty where a view has none.
    std::vector<Image<float>> depth;
    /// Scene units: pixels whose place is not known are so far away, behind everything.
    double farAway = 0;
    /// Pixels that have a place now, and those that are far away.
    std::int64_t placed = 0, far = 0;
};

/// Whether a view may have such pixels. Its own are not looked at.
[[nodiscard]] inline bool mayHaveUnmeasured(const ViewHeader& view) {
    return view.noDepth == NoDepth::unknown && !view.background;
}

/// Gives pixels of full alpha without depth the planes of the points around them, spread from pixel
/// to pixel as in PatchMatch stereo (Bleyer, Rhemann & Rother 2011): each takes its neighbour's
/// where other views show the same colours there, and nothing that they measured is before or
/// behind it; where they do not tell, where no edge of the picture is on the way. The others are
/// far away. Of perspective views with `wanted` and full alpha everywhere; all views are compared
/// with. What pruning took from a view, which others show, is not among them. The same
/// on any number of threads.
[[nodiscard]] UnmeasuredDepth unmeasuredDepth(std::span<const RefineView> views,
                                              const std::vector<bool>& wanted);

}  // namespace stx
