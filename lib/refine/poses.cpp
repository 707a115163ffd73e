#include "lib/refine/poses.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "lib/base/cpu_clock.hpp"
#include "lib/registration/camera_moves.hpp"
#include "lib/registration/refine_poses.hpp"

namespace stx {

namespace {

/// The whole size would take twice the time, and 0.05 dB is what it brings to the kitchen of
/// 7-Scenes.
constexpr int kFinest = 1;

/// For people, of poses that stay.
std::string whyTheyStay(const PoseRefinement& done) {
    if (done.before.pairs == 0) return "the poses stay as they are: no two views overlap";
    return fmt::format(
        "the poses stay as they are: overlapping views disagree by {:.2g} % of the distance, "
        "and refined they would by {:.2g} %",
        100 * done.before.relative, 100 * done.after.relative);
}

}  // namespace

Result<AlignedPoses> alignPoses(std::vector<PoseSample> views, AlignPoses when, Job& job) {
    AlignedPoses out;
    out.moves.resize(views.size());
    const double start = processMilliseconds();
    std::vector<Camera> before;
    for (const PoseSample& view : views) before.push_back(view.header.camera);
    PoseRefinementSettings settings;
    settings.finest = kFinest;
    settings.onlyIfColoursTell = when == AlignPoses::found;
    STX_TRY(const PoseRefinement done, refinePoses(views, settings, job));
    out.report.milliseconds = processMilliseconds() - start;
    if (done.before.pairs == 0 || !done.kept) {
        if (when == AlignPoses::asked) job.note(whyTheyStay(done));
        return out;
    }
    for (std::size_t i = 0; i < before.size(); ++i) {
        const Camera& now = views[i].header.camera;
        if (now == before[i]) continue;
        out.moves[i] = moveBetween(before[i], now);
        ++out.report.views;
    }
    job.note(fmt::format(
        "poses refined: viewpoints moved by up to {:.3g} scene units, turned by up to {:.3g} "
        "degrees; overlapping views disagreed by {:.2g} % of the distance and {:.2g} % of white, "
        "now by {:.2g} and {:.2g} %{}",
        done.maxShift, glm::degrees(done.maxTurn), 100 * done.before.relative,
        100 * done.coloursBefore, 100 * done.after.relative, 100 * done.coloursAfter,
        when == AlignPoses::found ? "; --refine auto,-poses leaves them" : ""));
    return out;
}

Result<RefineStepReport> alignPoses(Bundle& bundle, AlignPoses when, Job& job) {
    const double start = processMilliseconds();
    STX_TRY(AlignedPoses aligned,
            alignPoses(poseSamplesOf(bundle.views, samplePixels(bundle.views.size())), when, job));
    for (std::size_t i = 0; i < bundle.views.size(); ++i)
        if (aligned.moves[i]) moveCamera(bundle.views[i], *aligned.moves[i]);
    aligned.report.milliseconds = processMilliseconds() - start;
    return aligned.report;
}

bool posesWereAligned(const Bundle& bundle) {
    return std::ranges::any_of(bundle.views, [](const ReferenceView& view) {
        return wasDone(RefineStep::poses, view.refined);
    });
}

}  // namespace stx
