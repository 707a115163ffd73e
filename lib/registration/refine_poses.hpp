#pragma once

#include "lib/base/job.hpp"
#include "lib/registration/disagreement.hpp"

/// Registration: making views that overlap agree on where the surface is. Trackers, hand-measured
/// rigs and files whose poses belong to the frame before or after leave errors of a degree or a
/// centimetre; a renderer then shows everything twice.
namespace stx {

/// The error of the poses must stay below the tolerance.
struct PoseRefinementSettings : OverlapSettings {
    int iterations = 20;  ///< at each of three resolutions, at most
};

struct PoseRefinement {
    DepthDisagreement before, after;
    /// False: the views would disagree more than before, so all poses stayed as they were.
    bool kept = true;
    double maxShift = 0;  ///< of a viewpoint, scene units
    double maxTurn = 0;   ///< of an orientation, radians
};

/// Moves the cameras so that overlapping views agree in depth and colour: Gauss-Newton over all
/// poses together on both differences, from coarse to fine, robust against what only one view sees
/// (projective data association as in Newcombe et al., KinectFusion, 2011; colour as in Kerl et
/// al., Dense visual SLAM, 2013). The correction is the least that does it: views that overlap with
/// none, and the frame of the whole, stay. Intrinsics and images stay. Poses that
/// would make the views disagree more are not kept. The same result on any
/// number of threads. Grey pictures of all views are in `spool`, if any. Errors: cancelled.
[[nodiscard]] Result<PoseRefinement> refinePoses(Bundle& bundle,
                                                 const PoseRefinementSettings& settings, Job& job,
                                                 PixelSpool* spool = nullptr);

}  // namespace stx
