#include "lib/quality/prune_quality.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

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

/// The search of pruneToQuality(). Leaves the notes of what it settles on in the job.
Result<PruneReport> search(Bundle& bundle, const PruneSettings& settings, double wantedPsnr,
                           Job& job) {
    STX_TRY(const auto quality,
            ViewQuality::against(*makeCpuSurfaceRenderer(PageSet(bundle).refined({}), {}, job),
                                 posesOf(bundle), job));
    Bundle best;
    PruneReport report;
    std::vector<std::string> notes;
    const auto reaches = [&](double estimate) -> Result<bool> {
        (void)job.takeNotes();  // of the attempt before
        Bundle candidate = bundle;
        PruneSettings now = settings;
        now.minPsnr = estimate;
        STX_TRY(auto pruned, prune(candidate, now, job));
        STX_TRY(
            const auto psnr,
            quality.measure(*makeCpuSurfaceRenderer(PageSet(candidate).refined({}), {}, job), job));
        pruned.psnr = psnr.worst;
        if (!(pruned.psnr >= wantedPsnr)) return false;
        best = std::move(candidate);
        report = pruned;
        notes = job.takeNotes();
        return true;
    };
    STX_TRY(bool found, reaches(kLeast));
    if (!found) {
        double fails = kLeast, holds = kMost;
        // What the estimate promises is seldom kept: the search starts there.
        for (double middle = std::clamp(wantedPsnr, kLeast + kNear, kMost - kNear);
             holds - fails > kNear; middle = 0.5 * (fails + holds)) {
            STX_TRY(const bool good, reaches(middle));
            found = found || good;
            (good ? holds : fails) = middle;
        }
    }
    (void)job.takeNotes();
    if (!found) {
        const auto pixels = bundle.pointCount();
        if (settings.budget > 0 && settings.budget < pixels)
            return fail(
                ErrorCode::invalidInput,
                "a budget of {} pixels and {:g} dB cannot both be had: allow more pixels or "
                "ask for less",
                settings.budget, wantedPsnr);
        job.note(
            fmt::format("nothing is pruned: {:g} dB are reached by all pixels only", wantedPsnr));
        report.sourcePixels = report.keptPixels = pixels;
        report.psnr = std::numeric_limits<double>::infinity();
        return report;
    }
    for (auto& note : notes) job.note(std::move(note));
    bundle = std::move(best);
    return report;
}

}  // namespace

Result<PruneReport> pruneToQuality(Bundle& bundle, const PruneSettings& settings, double wantedPsnr,
                                   Job& job) {
    if (!(wantedPsnr > 0) || std::isinf(wantedPsnr))
        return fail(ErrorCode::usage, "the least PSNR is {:g} dB; it must be over 0", wantedPsnr);
    STX_CHECK(bundle.check());
    auto earlier = job.takeNotes();
    auto report = search(bundle, settings, wantedPsnr, job);
    auto ours = job.takeNotes();
    for (auto& note : earlier) job.note(std::move(note));
    for (auto& note : ours) job.note(std::move(note));
    return report;
}

}  // namespace stx
