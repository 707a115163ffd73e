#pragma once

#include <optional>
#include <vector>

#include "lib/base/job.hpp"
#include "lib/model/bundle.hpp"
#include "lib/refine/refine.hpp"
#include "lib/registration/pose_sample.hpp"

namespace stx {

struct AlignedPoses {
    RefineStepReport report;  ///< it counts the views whose camera moved
    /// Of each view; none: it stays.
    std::vector<std::optional<CameraMove>> moves;
};

enum class AlignPoses : std::uint8_t {
    asked,  ///< unless depth and colours disagree more then
    found,  ///< only where colours tell that they were off (PoseRefinement::coloursTell())
};

/// How cameras must move so that overlapping views agree (refinePoses() of lib/registration), where
/// they agree better then; a note says by how much, and, where it was asked for, why they stay.
/// Errors: cancelled.
[[nodiscard]] Result<AlignedPoses> alignPoses(std::vector<PoseSample> views, AlignPoses when,
                                              Job& job);
/// Moves the cameras of a bundle so, by samples of samplePixels(); bounds stay.
[[nodiscard]] Result<RefineStepReport> alignPoses(Bundle& bundle, AlignPoses when, Job& job);

/// Whether that moved cameras of a bundle before.
[[nodiscard]] bool posesWereAligned(const Bundle& bundle);

}  // namespace stx
