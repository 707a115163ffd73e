#pragma once

#include "lib/packing/prune.hpp"
#include "lib/packing/views_one_by_one.hpp"

namespace stx {

/// Prunes as far as rendered pictures still reach `wantedPsnr` (RGB, dB, 0 or more): the blocks
/// that replacements show worst come back until they do. Pictures are of surface mode at normal
/// quality, before and after, from up to six of the views' own poses and from half way between each
/// of these and the view nearest to it, at most 1024 pixels to a side; the worst counts, and
/// PruneReport::psnr is its PSNR. When nothing less than all pixels reaches it, all stay.
/// `settings.minPsnr` is not looked at. Notes of attempts that were given up are not passed on.
/// Errors: those of prune(); a budget that forbids what was asked, with both.
[[nodiscard]] Result<PruneReport> pruneToQuality(Bundle& bundle, const PruneSettings& settings,
                                                 double wantedPsnr, Job& job);
/// The same of views that are read when they are looked at: for the pictures before, and twice for
/// each attempt. Those to be drawn are in memory, after what pruning knows of them is gone. Errors
/// (invalidInput), before a view is read, where either takes more than the limit.
[[nodiscard]] Result<Pruning> findPruningToQuality(const ViewTable& table,
                                                   const PruneSettings& settings, double wantedPsnr,
                                                   Job& job);
/// What that takes beside pruning, of views in memory: pictures of all of them are drawn.
inline constexpr PeakMemory kDrawnAfterPruning = {"drawing what pruning keeps",
                                                  peak::kSurfaceMode.perPixel + 2};

}  // namespace stx
