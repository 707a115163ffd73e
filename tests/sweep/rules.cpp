#include "tests/sweep/rules.hpp"

#include "tests/sweep/measures.hpp"

namespace {

constexpr const char* kAlike =
    "sources that show a place equally well may be chosen otherwise: single pixels at edges";

}  // namespace

const std::vector<SweepRule>& rules() {
    static const std::vector<SweepRule> kRules{
        {"open", "no mode or quality leaves a place open that two views see", 0.5, "%",
         "half a percent of them: pixels beside outlines that nine pixels of a view do not tell", 1,
         measures::openWhereSeen},
        {"empty", "nothing is drawn where nothing is", 0.5, "%", "as for open places", 1,
         measures::drawnWhereEmpty},
        {"filled-empty", "nothing is filled in where views see that nothing is", 0.5, "%",
         "as for open places", 0.5, measures::filledWhereEmpty},
        {"quality-covers", "no quality covers less than the one below", 0.5, "%", "as asked", 1,
         measures::betterQualityCoversLess},
        {"quality-picture", "no quality is worse than the one below", 0.3, "dB", "as asked", 1,
         measures::betterQualityIsWorse},
        {"surface-splat", "surface mode is not worse than splats", 0.5, "dB", "as asked", 1,
         measures::surfaceBelowSplats},
        {"exact", "exact views are left as they are", 0, "repairs",
         "they have no noise, no fat edges and one light", 1, measures::exactDepthIsRepaired},
        {"crop", "a part of a frame is drawn as in the whole", 0.3, "dB", kAlike, 0.15,
         measures::crop},
        {"order", "views in another order give the same picture", 0.3, "dB", kAlike, 0.15,
         measures::otherOrder},
        {"twice", "a view that is there twice makes no picture worse", 0.3, "dB", kAlike, 0.1,
         measures::viewTwice},
        {"nothing", "a view that shows nothing changes nothing", 0.3, "dB", kAlike, 0.1,
         measures::viewOfNothing},
        {"coarser", "a view of few pixels makes no splats worse", 0.3, "dB",
         "what it alone shows may be drawn beside what is finer", 0.1, measures::viewOfFewPixels},
        {"turned", "the world turned by a quarter gives the same picture", 0.3, "dB", kAlike, 0.1,
         measures::turned},
        {"scaled", "the world scaled gives the same picture", 0.3, "dB", kAlike, 0.1,
         measures::scaled},
        {"moved", "the world moved far away gives the same picture", 0.3, "dB", kAlike, 0.1,
         measures::movedFar},
        {"mirrored", "the mirrored world gives the mirrored picture", 0.3, "dB", kAlike, 0.1,
         measures::mirrored},
        {"threads", "one thread and two draw the same bytes", 0, "pixels", "as promised", 0.1,
         measures::threads},
        {"gpu", "a GPU draws what the processor draws", 0.3, "dB", "", 0.05, measures::gpu},
        {"container", "a file keeps what is drawn", 0.3, "dB", "16 bits of depth", 0.15,
         measures::container},
        {"atlas", "an atlas is drawn like its views", 0.3, "dB", "", 0.15, measures::atlas},
        {"pruned", "a pruned atlas is drawn almost like its views, away from outlines", 2, "dB",
         "fewer views know where outlines run: those may move by a part of a texel", 0.1,
         measures::prunedAtlas},
        {"clock", "each frame of a film is shown at its time", 0, "frames", "as asked", 0.1,
         measures::clock},
        {"unknown", "a view whose depth is not known everywhere makes no picture worse", 0.3, "dB",
         "", 0.5, measures::unknownDepth},
        {"noisy", "noisy surfaces are not worse than noisy splats", 0.5, "dB", "as for exact depth",
         0.2, measures::noisySurfaceBelowSplats},
        {"pruned-covers", "a pruned atlas covers what its views do, and nothing else", 0.5, "%",
         "as for open places", 0.2, measures::prunedOutline},
        {"recorded-warp", "recorded views are not drawn worse than the naive warp of them all", 0.3,
         "dB", "as asked for pictures of some thousand pixels; where that covers", 0.2,
         measures::recordedBelowWarp},
        {"recorded-refine", "refining makes no picture of recorded views worse", 0.3, "dB",
         "as asked for pictures of some thousand pixels", 0.2, measures::refiningIsWorse},
        {"recorded-poses", "poses that are aligned make no picture of recorded views worse", 0.3,
         "dB", "as asked for pictures of some thousand pixels", 1, measures::aligningIsWorse},
        {"agree", "exact views agree about their distances", 0, "views",
         "what counts as one surface is far above what interpolation rounds", 1,
         measures::exactViewsDisagree},
        {"chosen", "the views that a picture needs draw what all do", 0, "pixels", "as promised",
         0.3, measures::chosenViews},
        {"wide", "pictures from amid a room leave no place open that two views see", 0.5, "%",
         "as for open places", 0.5, measures::openInWidePictures},
        {"beside-wall", "surfaces beside a wall are whole", 0.5, "%", "as for open places", 0.5,
         measures::openBesideWalls},
    };
    return kRules;
}
