#pragma once

#include <vector>

#include "lib/base/job.hpp"
#include "lib/registration/disagreement.hpp"
#include "lib/registration/pose_sample.hpp"

/// Registration: making views that overlap agree on where the surface is. Trackers, hand-measured
/// rigs and files whose poses belong to the frame before or after leave errors of a degree or a
/// centimetre; a renderer then shows everything twice.
namespace stx {

/// The error of the poses must stay below the tolerance.
struct PoseRefinementSettings : OverlapSettings {
    int iterations = 20;  ///< at each of three resolutions, at most
    int finest = 0;       ///< the last resolution: 1 and 2 are a half and a quarter of the images'
    /// Poses are kept only where colours tell that they were off: see
    /// PoseRefinement::coloursTell().
    bool onlyIfColoursTell = false;
};

struct PoseRefinement {
    DepthDisagreement before, after;
    /// How far the grey values of overlapping views are apart, once each pair's common difference
    /// is taken out: median of the pairs' medians, 0..1. 0: not measured.
    double coloursBefore = 0, coloursAfter = 0;
    /// False: all poses stayed as they were.
    bool kept = true;
    double maxShift = 0;       ///< of a viewpoint, scene units
    double maxShiftShare = 0;  ///< the same as a share of the distance of what a view shows
    double maxTurn = 0;        ///< of an orientation, radians

    /// Colours agree by 15 % and half a step of 8 bits better than before, depth about as well, and
    /// no camera turned by more than three degrees or moved by more than 3 % of the distance. Views
    /// whose poses are right do not come to that: over the sets of tests/bench/pictures.md colours
    /// of exact poses change by less than 1 %, those of recordings whose tracker drifted fall by 25
    /// to 77 %.
    [[nodiscard]] bool coloursTell() const;
};

/// Moves the cameras so that overlapping views agree in depth and colour: Gauss-Newton over all
/// poses together on both differences, from coarse to fine, robust against what only one view sees
/// (projective data association as in Newcombe et al., KinectFusion, 2011; colour as in Kerl et
/// al., Dense visual SLAM, 2013). The correction is the least that does it: views that overlap with
/// none, and the frame of the whole, stay. Intrinsics and images stay. Poses that
/// would make the depth of views disagree more are not kept, unless colours tell. The same result
/// on any number of threads. Errors: cancelled.
[[nodiscard]] Result<PoseRefinement> refinePoses(std::vector<PoseSample>& views,
                                                 const PoseRefinementSettings& settings, Job& job);
/// The same of a bundle, each view in all its pixels.
[[nodiscard]] Result<PoseRefinement> refinePoses(Bundle& bundle,
                                                 const PoseRefinementSettings& settings, Job& job);

}  // namespace stx
