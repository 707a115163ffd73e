#include "lib/selection/selection.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <numeric>

#include "lib/base/parallel_try.hpp"
#include "lib/capture/capture.hpp"
#include "lib/capture/rasterizer.hpp"
#include "lib/model/peak_memory.hpp"
#include "lib/selection/coverage.hpp"

namespace stx {
namespace {

/// Samples times views that a selection among a bundle's views looks at.
constexpr std::int64_t kLooks = 50'000'000;

Result<void> checkSettings(const SelectSettings& s) {
    if (s.count < 0)
        return fail(ErrorCode::usage, "{} views cannot be selected; at least 1 must be", s.count);
    if (!(s.share > 0 && s.share <= 1))
        return fail(ErrorCode::usage,
                    "the wanted share of quality is {:g}; it must be over 0 and at most 1",
                    s.share);
    if (!(s.targetDensity >= 0) || std::isinf(s.targetDensity))
        return fail(ErrorCode::usage, "the wanted density is {:g} samples per unit",
                    s.targetDensity);
    if (s.samples < 100 || s.samples > 10'000'000)
        return fail(ErrorCode::usage,
                    "{} surface samples were asked for; 100 to 10,000,000 are possible", s.samples);
    return {};
}

/// Share of the area seen by at least one of some views.
double seenShare(const CoverProblem& problem, const std::vector<int>& views) {
    std::vector<bool> seen(problem.weights.size(), false);
    for (const int v : views) {
        for (const auto& item : problem.views[v]) seen[item.sample] = true;
    }
    double all = 0, part = 0;
    for (std::size_t i = 0; i < seen.size(); ++i) {
        all += problem.weights[i];
        if (seen[i]) part += problem.weights[i];
    }
    return all > 0 ? part / all : 0;
}

Selection solve(const CoverProblem& problem, const SelectSettings& settings) {
    const int most = settings.count > 0 ? settings.count : static_cast<int>(problem.views.size());
    const CoverSolution solution = chooseCover(problem, most, settings.share);
    Selection s;
    s.views = solution.chosen;
    for (const double value : solution.values)
        s.quality.push_back(std::min(1.0, value / solution.all));
    s.certificate =
        solution.bound > 0 && !s.views.empty() ? solution.values.back() / solution.bound : 1;
    s.coverage = seenShare(problem, s.views);
    std::vector<int> every(problem.views.size());
    for (std::size_t i = 0; i < every.size(); ++i) every[i] = static_cast<int>(i);
    s.coverageOfAll = seenShare(problem, every);
    s.candidates = static_cast<int>(problem.views.size());
    return s;
}

/// Errors where no view finds any sample of the surface.
Result<Selection> solveOrFail(const CoverProblem& problem, const SelectSettings& settings) {
    Selection selection = solve(problem, settings);
    if (selection.views.empty())
        return fail(ErrorCode::failed,
                    "none of the {} views sees anything of the surface that their points make",
                    problem.views.size());
    return selection;
}

/// Errors where no view has a point; a note where some have none.
Result<void> checkPoints(const std::vector<std::int64_t>& points, Job& job) {
    const auto empty = std::ranges::count(points, 0);
    if (empty == std::ssize(points))
        return fail(ErrorCode::invalidInput, "none of the {} views has a point to select by",
                    empty);
    if (empty > 0)
        job.note(fmt::format("{} of {} views dropped: they are empty", empty, points.size()));
    return job.checkCancelled();
}

/// Each sample is looked for in each view: thousands of views get fewer samples.
int samplesFor(const SelectSettings& settings, std::size_t views) {
    return static_cast<int>(std::min<std::int64_t>(
        settings.samples, std::max<std::int64_t>(1000, kLooks / static_cast<std::int64_t>(views))));
}

}  // namespace

Result<Selection> selectViews(const Bundle& bundle, const SelectSettings& settings, Job& job) {
    STX_CHECK(checkSettings(settings));
    STX_CHECK(bundle.check());
    STX_CHECK(checkPeak(peak::kSelect, bundle.views, job.limits));
    std::vector<std::int64_t> points;
    for (const auto& v : bundle.views) points.push_back(v.pointCount());
    STX_CHECK(checkPoints(points, job));
    std::vector<CandidateView> candidates;
    const auto samples =
        sampleBundle(bundle, samplesFor(settings, bundle.views.size()), &candidates);
    STX_CHECK(job.checkCancelled());
    const auto problem = coverProblem(samples, candidates, settings.targetDensity);
    STX_CHECK(job.checkCancelled());
    return solveOrFail(problem, settings);
}

Result<Selection> selectViews(const ViewTable& table, const SelectSettings& settings, Job& job) {
    STX_CHECK(checkSettings(settings));
    // What there is to say is said when the chosen ones are read again.
    Job quiet;
    quiet.workFor(job);
    quiet.onProgress = job.onProgress;
    std::vector<std::int64_t> points(table.count());
    if (const auto summaries = table.summaries(); !summaries.empty()) {
        std::ranges::transform(summaries, points.begin(), &ViewSummary::points);
    } else {
        const auto count = [&](std::size_t i,
                               const std::shared_ptr<const ReferenceView>& view) -> Result<void> {
            points[i] = view->pointCount();
            return {};
        };
        STX_CHECK(forEachView(table, peak::kSelect, quiet, count));
    }
    STX_CHECK(checkPoints(points, job));
    const std::int64_t all = std::accumulate(points.begin(), points.end(), std::int64_t{0});
    STX_TRY(const auto problem, coverProblem(table, all, samplesFor(settings, table.count()),
                                             settings.targetDensity, quiet));
    return solveOrFail(problem, settings);
}

Bundle keepViews(Bundle bundle, const std::vector<int>& views) {
    std::vector<int> sorted = views;
    std::sort(sorted.begin(), sorted.end());
    std::vector<ReferenceView> kept;
    for (const int v : sorted) kept.push_back(std::move(bundle.views[v]));
    bundle.views = std::move(kept);
    return bundle;
}

Result<MeshSelection> selectMeshViews(const Mesh& mesh, const MeshCandidates& candidates,
                                      const SelectSettings& settings, Job& job) {
    STX_CHECK(checkSettings(settings));
    if (candidates.directions < 1 || candidates.directions > 4096 || candidates.depthSize < 16 ||
        candidates.depthSize > 2048)
        return fail(
            ErrorCode::usage,
            "{} candidate directions with depth images of {} pixels; 1 to 4096 and 16 to 2048 "
            "are possible",
            candidates.directions, candidates.depthSize);
    STX_CHECK(mesh.check());
    ViewLayout layout;
    layout.kind = ViewLayout::Kind::sphere;
    layout.count = candidates.directions;
    STX_TRY(const auto cameras, layoutCameras(layout, candidates.framing, drawnPoints(mesh)));

    const auto samples = sampleMesh(mesh, settings.samples);
    if (samples.empty())
        return fail(ErrorCode::invalidInput, "the mesh has no surface to select views for");
    const auto count = static_cast<std::int64_t>(cameras.size());
    std::vector<std::vector<SeenSample>> seen(cameras.size());
    std::atomic<std::int64_t> finished = 0;
    const auto looked = parallelTry(0, count, [&](std::int64_t i) -> Result<void> {
        STX_CHECK(job.checkCancelled());
        const Camera& camera = cameras[i];
        const double scale =
            static_cast<double>(candidates.depthSize) / std::max(camera.width, camera.height);
        const auto shrunk = [&](int side) {
            return std::max(1, static_cast<int>(std::lround(side * scale)));
        };
        CandidateView view;
        view.camera = camera;
        view.depthCamera =
            scale < 1 ? camera.resized(shrunk(camera.width), shrunk(camera.height)) : camera;
        RasterSettings raster;
        raster.supersampling = 1;
        raster.normals = true;
        STX_TRY(const auto image, rasterise(mesh, view.depthCamera, raster, job));
        view.depth = &image.depth;
        view.normal = &image.normal;
        seen[i] = seenBy(view, samples);
        job.progress(++finished, count, "looking from candidate directions");
        return {};
    });
    STX_CHECK(looked);
    auto problem = coverProblem(samples, std::move(seen), settings.targetDensity);
    weighSides(samples, problem);
    STX_CHECK(job.checkCancelled());
    MeshSelection result;
    result.selection = solve(problem, settings);
    result.selection.neverSeen = 1 - result.selection.coverageOfAll;
    if (result.selection.views.empty())
        return fail(ErrorCode::failed, "no candidate direction sees anything of the mesh");
    for (const int v : result.selection.views) result.cameras.push_back(cameras[v]);
    return result;
}

Result<int> leastViews(int most, double target, const std::function<Result<double>(int)>& measure) {
    if (most < 1)
        return fail(ErrorCode::usage, "the least number of views is sought among {} views", most);
    int fails = 0, reaches = 1;
    for (;; reaches = std::min(reaches * 2, most)) {
        STX_TRY(const double value, measure(reaches));
        if (value >= target) break;
        fails = reaches;
        if (reaches == most) return most;
    }
    while (reaches - fails > 1) {
        const int middle = fails + (reaches - fails) / 2;
        STX_TRY(const double value, measure(middle));
        (value >= target ? reaches : fails) = middle;
    }
    return reaches;
}

}  // namespace stx
