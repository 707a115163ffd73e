#include "lib/quality/prune_quality.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "lib/quality/view_quality.hpp"
#include "lib/render/surface/cpu/cpu_surface.hpp"

namespace stx {
namespace {

constexpr int kPoses = 6;
constexpr int kMostSide = 1024;
/// Estimates between which the search goes on, dB. The first gives nothing back.
constexpr double kLeast = 1, kMost = 72, kNear = 1.5;

Camera pose(const Camera& camera) {
    const double scale = static_cast<double>(kMostSide) / std::max(camera.width, camera.height);
    if (scale >= 1) return camera;
    const auto shrunk = [&](int side) {
        return std::max(1, static_cast<int>(std::lround(side * scale)));
    };
    return camera.resized(shrunk(camera.width), shrunk(camera.height));
}

/// Own poses, and half way to the next view where that looks much the same way.
std::vector<Camera> posesOf(const Bundle& bundle) {
    const auto count = static_cast<int>(bundle.views.size());
    std::vector<Camera> poses;
    for (int k = 0; k < std::min(count, kPoses); ++k) {
        const int i =
            static_cast<int>(static_cast<std::int64_t>(k) * count / std::min(count, kPoses));
        const Camera& own = bundle.views[i].camera;
        poses.push_back(pose(own));
        int nearest = -1;
        double least = std::numeric_limits<double>::infinity();
        for (int j = 0; j < count; ++j) {
            const Camera& other = bundle.views[j].camera;
            const double away = glm::length(own.position - other.position);
            if (j == i || away >= least || glm::dot(own.forward(), other.forward()) < 0.2) continue;
            least = away;
            nearest = j;
        }
        if (nearest < 0) continue;
        const Camera& other = bundle.views[nearest].camera;
        Camera between = own;
        between.position = 0.5 * (own.position + other.position);
        between.orientation = glm::normalize(glm::slerp(own.orientation, other.orientation, 0.5));
        poses.push_back(pose(between));
    }
    return poses;
}

std::unique_ptr<Renderer> pruneRenderer(const Bundle& bundle, Job& job) {
    return makeCpuSurfaceRenderer(PageSet(bundle).refined({}), {}, job);
}

Result<ViewQuality> picturesBefore(const ViewTable& table, Job& job) {
    const auto of = [&job](const Bundle& bundle) {
        return ViewQuality::against(*pruneRenderer(bundle, job), posesOf(bundle), job);
    };
    if (table.whole()) return of(table.about());
    STX_TRY(const Bundle bundle, wholeBundle(table, job));
    return of(bundle);
}

/// Of views without those points that pruning takes, dB; the worst picture's.
Result<double> psnrOf(const ViewTable& table, const Pruning& pruning, const ViewQuality& quality,
                      Job& job) {
    STX_TRY(const Bundle kept, wholeBundle(*prunedViews(table, pruning), job));
    STX_TRY(const auto psnr, quality.measure(*pruneRenderer(kept, job), job));
    return psnr.worst;
}

/// What keeps all; `tried` is the report of another attempt.
Pruning nothingPruned(const ViewTable& table, const PruneReport& tried) {
    Pruning out;
    out.report = tried;
    out.report.keptPixels = tried.sourcePoints;
    out.report.emptiedViews = 0;
    out.report.psnr = std::numeric_limits<double>::infinity();
    out.changed.resize(table.count(), false);
    for (const ReferenceView& view : table.about().views)
        out.kept.emplace_back(view.camera.width, view.camera.height, std::uint8_t{1});
    return out;
}

}  // namespace

Result<Pruning> findPruningToQuality(const ViewTable& table, const PruneSettings& settings,
                                     double wantedPsnr, Job& job) {
    if (!(wantedPsnr >= 0) || std::isinf(wantedPsnr))
        return fail(ErrorCode::usage, "the least PSNR is {:g} dB; it must be 0 or more",
                    wantedPsnr);
    STX_CHECK(checkPruning(table, job.limits));
    STX_CHECK(job.limits.checkAllocation(memoryOfAll(table, kDrawnAfterPruning), 1,
                                         kDrawnAfterPruning.what));
    Job quiet;  // what reading says is said where the views are packed
    quiet.workFor(job);
    STX_TRY(const auto quality, picturesBefore(table, quiet));
    std::optional<Pruning> best;
    std::vector<std::string> notes;  // of the best
    PruneReport tried;
    const auto reaches = [&](double estimate) -> Result<bool> {
        Job attempt;
        attempt.workFor(job);
        PruneSettings now = settings;
        now.minPsnr = estimate;
        STX_TRY(auto pruned, findPruning(table, now, attempt));
        tried = pruned.report;
        auto said = attempt.takeNotes();
        STX_TRY(pruned.report.psnr, psnrOf(table, pruned, quality, quiet));
        if (!(pruned.report.psnr >= wantedPsnr)) return false;
        best = std::move(pruned);
        notes = std::move(said);
        return true;
    };
    STX_TRY(const bool least, reaches(kLeast));
    if (!least) {
        double fails = kLeast, holds = kMost;
        // What the estimate promises is seldom kept: the search starts there.
        for (double middle = std::clamp(wantedPsnr, kLeast + kNear, kMost - kNear);
             holds - fails > kNear; middle = 0.5 * (fails + holds)) {
            STX_TRY(const bool good, reaches(middle));
            (good ? holds : fails) = middle;
        }
    }
    for (auto& note : notes) job.note(std::move(note));
    if (best) return std::move(*best);
    if (settings.budget > 0 && settings.budget < tried.sourcePoints)
        return fail(ErrorCode::invalidInput,
                    "a budget of {} pixels and {:g} dB cannot both be had: allow more pixels or "
                    "ask for less",
                    settings.budget, wantedPsnr);
    job.note(fmt::format("nothing is pruned: {:g} dB are reached by all pixels only", wantedPsnr));
    return nothingPruned(table, tried);
}

Result<PruneReport> pruneToQuality(Bundle& bundle, const PruneSettings& settings, double wantedPsnr,
                                   Job& job) {
    STX_CHECK(bundle.check());
    STX_TRY(const auto pruning, findPruningToQuality(*viewsOf(bundle), settings, wantedPsnr, job));
    applyPruning(pruning, bundle);
    return pruning.report;
}

}  // namespace stx
