#pragma once

#include <cstdint>

#include "lib/base/image.hpp"
#include "lib/base/job.hpp"
#include "lib/model/bundle.hpp"

namespace stx {

/// What pruning may take away.
struct PruneSettings {
    /// Object pixels to keep at most; 0 = no limit. Without a limit and without minPsnr everything
    /// goes that another view shows at a finer or equal rate.
    std::int64_t budget = 0;
    /// Estimated PSNR of the pruned pixels against what replaces them, dB; 0 = not asked for. Of
    /// pictures it promises little: pruneToQuality() measures them.
    double minPsnr = 0;
    /// Pixels kept around each kept region, so that filters work across its border; 0..16. With a
    /// budget it grows as far as there is room.
    int overlap = 2;
    /// A view may replace pixels that sample the surface up to this factor finer than it does,
    /// >= 1.
    double rateTolerance = 1.25;
    /// Distances of one surface seen by two views agree within this share of the distance (and the
    /// steps of the depth codes, and half a pixel of slope), over 0, at most 0.1.
    double depthTolerance = 0.003;
    /// Colours of one surface agree within this, 0..1 in the bundle's own coding, beyond the
    /// contrast of the pixels around.
    double colourTolerance = 0.06;
};

struct PruneReport {
    std::int64_t sourcePixels = 0;  ///< before: points, and full alpha without a distance
    std::int64_t sourcePoints = 0;  ///< of these the points, which alone are pruned
    std::int64_t keptPixels = 0;    ///< points after
    double psnr = 0;                ///< estimate, dB; infinity when nothing was lost
    int emptiedViews = 0;           ///< views without a pixel left
    /// Pixels that have colours but no depth, of views that fill their frames: prune() keeps them.
    std::int64_t unmeasuredPixels = 0;
};

/// Takes away pixels that other views show as well or better. Which view keeps a piece of surface:
/// views are ranked by what they add to the coverage of the object, and a pixel goes when all four
/// pixels around its place in a view of higher rank are kept, show the same surface, sample it at a
/// finer or equal rate and agree in colour; or when a view of lower rank shows it finer. Where
/// views have background at its place, one view more than these must show it so. What replaces a
/// pixel is kept for good, so no hole can open.
///
/// A pixel taken away has no depth but full alpha: "the object is here, another view gives its
/// distance". Renderers take no empty space from it. So are the background pixels beside pruned
/// silhouettes. It keeps its colour, normal, metallic-roughness and emission next to kept pixels,
/// for filters, and next to colours that were never measured (NoDepth::unknown), which all stay;
/// farther off the colours are smooth and the others zero. A view with NoDepth::unknown becomes
/// NoDepth::empty where lacksDepthByMask(): where an atlas keeps nothing of it is then empty or
/// pruned.
///
/// Errors: settings out of range; a bundle that fails check(); a budget below what can be kept
/// without a hole, with that number; cancelled. A pruned bundle gives the same bytes on any number
/// of threads.
[[nodiscard]] Result<PruneReport> prune(Bundle& bundle, const PruneSettings& settings, Job& job);

/// Takes the points that are not in `kept` (1 = stays; as large as the view) out of a view, as
/// prune() does.
void keepOnly(const Image<std::uint8_t>& kept, ReferenceView& view);

}  // namespace stx
