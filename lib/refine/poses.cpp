#include "lib/refine/poses.hpp"

#include <algorithm>
#include <vector>

#include <fmt/format.h>

#include "lib/base/cpu_clock.hpp"
#include "lib/registration/refine_poses.hpp"

namespace stx {

Result<RefineStepReport> alignPoses(Bundle& bundle, PixelSpool* spool, Job& job) {
    RefineStepReport report;
    const double start = processMilliseconds();
    std::vector<Camera> before;
    for (const ReferenceView& view : bundle.views) before.push_back(view.camera);
    STX_TRY(const PoseRefinement done, refinePoses(bundle, {}, job, spool));
    report.milliseconds = processMilliseconds() - start;
    if (done.before.pairs == 0) {
        job.note("the poses stay as they are: no two views overlap");
        return report;
    }
    if (!done.kept) {
        job.note(fmt::format(
            "the poses stay as they are: overlapping views disagree by {:.2g} % of the distance, "
            "and refined they would by {:.2g} %",
            100 * done.before.relative, 100 * done.after.relative));
        return report;
    }
    for (std::size_t i = 0; i < before.size(); ++i)
        report.views += !(bundle.views[i].camera == before[i]);
    job.note(fmt::format(
        "poses refined: viewpoints moved by up to {:.3g} scene units, turned by up to {:.3g} "
        "degrees; overlapping views disagreed by {:.2g} % of the distance, now by {:.2g} %",
        done.maxShift, glm::degrees(done.maxTurn), 100 * done.before.relative,
        100 * done.after.relative));
    return report;
}

bool posesWereAligned(const Bundle& bundle) {
    return std::ranges::any_of(bundle.views, [](const ReferenceView& view) {
        return wasDone(RefineStep::poses, view.refined);
    });
}

}  // namespace stx
