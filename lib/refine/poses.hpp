#pragma once

#include "lib/base/job.hpp"
#include "lib/model/bundle.hpp"
#include "lib/refine/refine.hpp"

namespace stx {

/// Moves the cameras of a bundle so that overlapping views agree (refinePoses() of
/// lib/registration), where they agree better then; a note says by how much, or why they stay. The
/// report counts the views whose camera moved. What is made of all views is in `spool`, if any.
/// Errors: cancelled.
[[nodiscard]] Result<RefineStepReport> alignPoses(Bundle& bundle, PixelSpool* spool, Job& job);

/// Whether that moved cameras of a bundle before.
[[nodiscard]] bool posesWereAligned(const Bundle& bundle);

}  // namespace stx
