#include "lib/quality/ablation.hpp"

#include <algorithm>
#include <limits>

#include "lib/base/cpu_clock.hpp"
#include "lib/capture/capture.hpp"
#include "lib/geometry/view_layout.hpp"
#include "lib/render/factory.hpp"

namespace stx {
namespace {

constexpr int kViews = 16, kSide = 512;
/// Views of a bundle that are left out, at most, and the fewest that stay for each of them.
constexpr std::size_t kMostTruths = 4, kFewestLeft = 2;

Result<AblationCell> measured(const Bundle& bundle, const ViewQuality& truth,
                              const RenderSettings& settings, int repeats, Job& job) {
    AblationCell cell{0, std::numeric_limits<double>::infinity()};
    for (int i = 0; i < repeats; ++i) {
        Job quiet;
        quiet.workFor(job);
        const double start = processMilliseconds();
        STX_TRY(const auto renderer, makeRenderer(Backend::cpu, bundle, settings, -1, quiet));
        STX_TRY(const auto psnr, truth.measure(*renderer, job));
        cell.psnr = psnr.all;
        cell.milliseconds = std::min(cell.milliseconds, processMilliseconds() - start);
    }
    return cell;
}

/// Takes the views of a bundle out of it that are the truth: the middle one of each of `count`
/// parts.
std::vector<ReferenceView> takeTruths(Bundle& bundle) {
    const std::size_t views = bundle.views.size();
    const std::size_t count = std::min(kMostTruths, views / (kFewestLeft + 1));
    std::vector<ReferenceView> truths, left;
    for (std::size_t i = 0; i < views; ++i) {
        const std::size_t part = i * count / views;
        const std::size_t middle = (part * views + views / 2) / std::max<std::size_t>(count, 1);
        (count > 0 && i == middle ? truths : left).push_back(std::move(bundle.views[i]));
    }
    bundle.views = std::move(left);
    return truths;
}

/// A row of the sets read without a step of their import; sets whose import did not do it are as
/// in `whole`.
Result<AblationRow> withoutImportStep(const RefineStepInfo& step,
                                      const std::vector<AblationSet>& sets,
                                      const AblationRow& whole, const RenderSettings& settings,
                                      int repeats, Job& job) {
    AblationRow row{std::string(step.name), whole.cells};
    for (std::size_t i = 0; i < sets.size(); ++i) {
        if (std::ranges::find(sets[i].atImport, step.step) == sets[i].atImport.end()) continue;
        Job quiet;
        quiet.workFor(job);
        STX_TRY(Bundle bundle, sets[i].importWithout(step.step, quiet));
        (void)takeTruths(bundle);
        STX_TRY(row.cells[i], measured(bundle, sets[i].truth, settings, repeats, job));
    }
    return row;
}

}  // namespace

Result<AblationSet> AblationSet::of(const Mesh& mesh, Job& job) {
    AblationSet set;
    ViewLayout layout;
    layout.count = kViews;
    ViewFraming framing;
    framing.width = framing.height = kSide;
    STX_TRY(const auto cameras, layoutCameras(layout, framing, drawnPoints(mesh)));
    STX_TRY(set.bundle, captureBundle(mesh, cameras, {}, job));
    STX_TRY(set.truth, ViewQuality::against(mesh, kSide, job));
    return set;
}

Result<AblationSet> AblationSet::of(Bundle bundle) {
    const std::size_t views = bundle.views.size();
    if (views < kFewestLeft + 1)
        return fail(ErrorCode::usage,
                    "it has {} views; one of three is left out to compare with, so that at least "
                    "three are needed",
                    views);
    AblationSet set;
    set.truth = ViewQuality::of(takeTruths(bundle));
    set.bundle = std::move(bundle);
    return set;
}

Result<std::vector<AblationRow>> ablate(const std::vector<AblationSet>& sets,
                                        const RenderSettings& settings, int repeats, Job& job) {
    std::vector<std::pair<std::string, RenderSettings>> all{{"", settings}};
    for (const RefineStepInfo& step : refineSteps()) {
        RenderSettings without = settings;
        if (settings.mode == RenderMode::splat) without.refine = without.refine.forSplats();
        if (!without.refine.on(step.step)) continue;
        without.refine.set(step.step, false);
        all.emplace_back(step.name, without);
    }
    const StageMode other =
        settings.mode == RenderMode::splat ? StageMode::surface : StageMode::splat;
    for (const StageInfo& stage : stages()) {
        if (stage.mode == other) continue;
        all.emplace_back(stage.name, settings);
        all.back().second.without.add(stage.stage);
    }
    std::vector<AblationRow> rows;
    for (std::size_t i = 0; i < all.size(); ++i) {
        rows.push_back({all[i].first, {}});
        for (const AblationSet& set : sets) {
            STX_TRY(const auto cell, measured(set.bundle, set.truth, all[i].second, repeats, job));
            rows.back().cells.push_back(cell);
        }
        job.progress(static_cast<std::int64_t>(i + 1), static_cast<std::int64_t>(all.size()),
                     "leaving out stages");
        if (i > 0) continue;
        for (const RefineStepInfo& step : refineSteps()) {
            if (std::ranges::none_of(sets, [&](const AblationSet& set) {
                    return std::ranges::find(set.atImport, step.step) != set.atImport.end();
                }))
                continue;
            STX_TRY(auto row, withoutImportStep(step, sets, rows[0], settings, repeats, job));
            rows.push_back(std::move(row));
        }
    }
    return rows;
}

}  // namespace stx
