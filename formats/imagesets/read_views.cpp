#include "formats/imagesets/read_views.hpp"

#include <algorithm>
#include <atomic>

#include "formats/exr/environment_exr.hpp"
#include "formats/files/messages.hpp"
#include "formats/imagesets/kinds.hpp"
#include "lib/background/behind_photo.hpp"
#include "lib/base/parallel.hpp"
#include "lib/base/unique_names.hpp"
#include "lib/geometry/origin.hpp"
#include "lib/model/depth_values.hpp"
#include "lib/model/linear_views.hpp"
#include "lib/registration/camera_moves.hpp"
#include "lib/registration/disagreement.hpp"

namespace stx::imagesets {
namespace {

/// Aligns the poses where that is due, and says which views disagree.
Result<void> attendToPoses(Bundle& bundle, const ImageSetOptions& options,
                           const std::vector<Bounds>& each, glm::dvec3 subtracted,
                           RefineReport& report, Job& job) {
    const auto when = alignsPoses(bundle, options);
    if (when) {
        STX_CHECK(alignCameras(bundle,
                               poseSamplesOf(bundle.views, samplePixels(bundle.views.size())),
                               *when, each, subtracted, report, job));
    }
    const bool aligned = when == AlignPoses::asked || posesWereAligned(bundle);
    if (const auto note = disagreementNote(bundle, measureDepthDisagreement(bundle), aligned))
        job.note(*note);
    return {};
}

/// Cameras of an export of ours count from its origin, to the bit as they were.
void useOrigin(SetDescription& set) {
    if (!set.origin) return;
    for (SetView& view : set.views) {
        const glm::dvec3 local = view.camera.position - *set.origin;
        // Equal but for the rounding of the sum, unless somebody moved the camera since.
        const double slack = 1e-12 * (1 + glm::length(*set.origin));
        view.camera.position =
            view.localPosition && glm::distance(*view.localPosition, local) <= slack
                ? *view.localPosition
                : local;
    }
}

/// What is known of a camera without a picture: its place and its size.
void makeUnknown(ReferenceView& view) {
    view.noDepth = NoDepth::unknown;
    view.pruned = false;
    std::ranges::fill(view.depth.pixels(), kNoDepth);
    if (Rgba8Image* texture = view.texture.rgba8())
        std::ranges::fill(texture->pixels(), glm::u8vec4(0, 0, 0, 255));
    if (RgbaFloatImage* texture = view.texture.rgbaFloat())
        std::ranges::fill(texture->pixels(), glm::vec4(0, 0, 0, 1));
}

/// Pictures of one bundle are all coded alike: where some hold linear light, the others' 8 bits
/// become floats, too.
void makeAllLinear(std::vector<ReferenceView>& views) {
    const auto linear = [](const ReferenceView& view) { return view.texture.isLinear(); };
    if (std::ranges::any_of(views, linear)) std::ranges::for_each(views, makeLinear);
}

}  // namespace

Result<void> dropMissing(SetDescription& set, bool strict, Job& job) {
    const auto isMissing = [](const SetView& view) { return view.missing.has_value(); };
    const auto missing = std::ranges::count_if(set.views, isMissing);
    if (missing == 0) return {};
    const auto all = std::ssize(set.views);
    if (strict || missing == all)
        return tl::unexpected(*std::ranges::find_if(set.views, isMissing)->missing);
    for (const bool lost : {false, true}) {
        const auto isThis = [&](const SetView& view) {
            return isMissing(view) && view.lost == lost;
        };
        const auto first = std::ranges::find_if(set.views, isThis);
        if (first == set.views.end()) continue;
        const Error error = *first->missing;
        const auto dropped = std::erase_if(set.views, isThis);
        job.note(fmt::format("{} of {} views {} left out, as {}; the first: {}", dropped, all,
                             dropped == 1 ? "is" : "are",
                             lost ? "tracking was lost" : "files are missing", error.text()));
    }
    return {};
}

Result<void> checkFilesAreThere(const SetDescription& set) {
    for (const SetView& view : set.views)
        for (const PictureSource* source : {&view.texture, &view.depth})
            if (source->missing) return tl::unexpected(*source->missing);
    return {};
}

Result<void> prepareToRead(SetDescription& set, const std::string& where,
                           const ImageSetOptions& options, Job& job) {
    useOrigin(set);
    if (set.views.empty())
        return failAt(where, ErrorCode::invalidInput,
                      "it has no view; at least one with a picture and a depth image is expected");
    STX_CHECK(dropMissing(set, options.strict, job));
    STX_CHECK(checkFilesAreThere(set));
    return checkViewCount(set.views.size(), job.limits, where);
}

Result<std::vector<ReferenceView>> loadOne(const SetView& view, const ImageSetOptions& options,
                                           RefineReport& report, bool& showsNothing, Job& job) {
    try {
        STX_TRY(auto views, loadSetView(view, options, report, showsNothing, job));
        if (view.absent) std::ranges::for_each(views, makeUnknown);
        return views;
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::failed, "view '{}': there is not enough memory", view.name);
    }
}

Result<LoadedViews> loadEach(
    const SetDescription& set, const std::string& where, const ImageSetOptions& options,
    std::size_t atOnce, Job& job, std::optional<std::size_t>* failing,
    const std::function<Result<void>(std::size_t, std::vector<ReferenceView>)>& take) {
    const std::size_t count = set.views.size();
    const bool needAll = failing || options.strict || set.frames > 1;
    std::vector<Result<void>> loaded(count);
    std::vector<char> showNothing(count);
    // Notes and reports in the order of the views, whichever is ready first.
    std::vector<RefineReport> reports(count);
    std::vector<Job> jobs(count);
    for (Job& own : jobs) own.workFor(job);
    std::atomic<std::int64_t> done = 0;
    std::atomic<bool> failed = false;
    for (std::size_t first = 0; first < count && !failed; first += atOnce) {
        const std::size_t end = std::min(first + atOnce, count);
        parallelFor(
            static_cast<std::int64_t>(first), static_cast<std::int64_t>(end), [&](std::int64_t i) {
                const auto at = static_cast<std::size_t>(i);
                if (failed) return;
                loaded[at] = [&]() -> Result<void> {
                    bool nothing = false;
                    auto views = loadOne(set.views[at], options, reports[at], nothing, jobs[at]);
                    showNothing[at] = nothing && !needAll;
                    if (!views) return tl::unexpected(std::move(views.error()));
                    return take(at, *std::move(views));
                }();
                if (!loaded[at] && !showNothing[at] && !options.failedView) failed = true;
                job.progress(++done, static_cast<std::int64_t>(count), "reading views");
            });
    }
    for (Job& own : jobs) own.passNotesOn();
    LoadedViews out;
    if (options.failedView)
        for (std::size_t i = 0; i < count; ++i)
            if (!loaded[i] && !showNothing[i]) options.failedView(loaded[i].error().at(where));
    for (std::size_t i = 0; i < count; ++i) {
        if (loaded[i]) continue;
        if (showNothing[i]) {
            if (out.showNothing.empty()) out.why = loaded[i].error();
            out.showNothing.push_back(i);
            if (out.showNothing.size() < count) continue;
        }
        if (failing) *failing = i;
        return tl::unexpected((showNothing[i] ? out.why : loaded[i].error()).at(where));
    }
    for (const RefineReport& ofView : reports) out.report.add(ofView);
    return out;
}

void leaveOut(const LoadedViews& loaded, SetDescription& set, Job& job) {
    const std::size_t all = set.views.size(), count = loaded.showNothing.size();
    if (count == 0) return;
    for (std::size_t i = count; i-- > 0;)
        set.views.erase(set.views.begin() + static_cast<std::ptrdiff_t>(loaded.showNothing[i]));
    job.note(
        fmt::format("{} of {} views {} left out, as no pixel has a usable depth; the first: {}",
                    count, all, count == 1 ? "is" : "are", loaded.why.text()));
}

void makeNamesUnique(std::vector<ReferenceView>& views) {
    UniqueNames names("_", 2);
    for (ReferenceView& view : views)
        view.name = names.take(view.name.empty() ? "view" : view.name);
}

glm::dvec3 findOrigin(Bundle& bundle, const SetDescription& set, Job& job) {
    if (set.origin) {
        bundle.origin = *set.origin;
        return glm::dvec3(0.0);
    }
    const auto origin = originFor(*bundle.bounds);
    if (origin == glm::dvec3(0.0)) return origin;
    bundle.origin = origin;
    for (ReferenceView& view : bundle.views) view.camera.position -= origin;
    bundle.bounds = Bounds{bundle.bounds->min - origin, bundle.bounds->max - origin};
    job.note(fmt::format(
        "the coordinates are too large for 32-bit floats: the origin {} {} {} is subtracted, and "
        "kept beside them",
        origin.x, origin.y, origin.z));
    return origin;
}

bool depthWasMeasured(const ViewHeader& view) {
    return view.noDepth == NoDepth::unknown && !view.pruned && !view.background;
}

std::optional<AlignPoses> alignsPoses(const Bundle& about, const ImageSetOptions& options) {
    if (options.refine.of(RefineStep::poses) == RefineSwitch::on) return AlignPoses::asked;
    const bool measured = about.views.size() > 1 && !posesWereAligned(about) &&
                          std::ranges::all_of(about.views, depthWasMeasured);
    if (!options.refine.atImport(RefineStep::poses, measured)) return {};
    return AlignPoses::found;
}

Result<void> alignCameras(Bundle& about, std::vector<PoseSample> samples, AlignPoses when,
                          const std::vector<Bounds>& each, glm::dvec3 subtracted,
                          RefineReport& report, Job& job) {
    STX_TRY(const AlignedPoses aligned, alignPoses(std::move(samples), when, job));
    RefineReport ofPoses;
    ofPoses.of(RefineStep::poses) = aligned.report;
    report.add(ofPoses);
    if (aligned.report.views == 0) return {};
    about.bounds.emplace();
    for (std::size_t i = 0; i < about.views.size(); ++i) {
        ReferenceView& view = about.views[i];
        const Camera before = view.camera;
        if (aligned.moves[i]) moveCamera(view, *aligned.moves[i]);
        ofPoses.record(view.refined);
        if (each[i].empty()) continue;
        const Bounds local{each[i].min - subtracted, each[i].max - subtracted};
        const Bounds moved = movedBounds(local, before, view.camera);
        about.bounds->add(moved.min);
        about.bounds->add(moved.max);
    }
    return {};
}

Result<Bundle> readViews(SetDescription set, const std::string& where,
                         const ImageSetOptions& options, Job& job,
                         std::optional<std::size_t>* failing) {
    STX_CHECK(prepareToRead(set, where, options, job));
    std::uint64_t pixels = 0;
    for (const SetView& view : set.views)
        pixels += static_cast<std::uint64_t>(view.camera.width) * view.camera.height;
    STX_CHECK(within(
        where, job.limits.checkAllocation(
                   pixels, sizeof(float) + sizeof(glm::u8vec4),
                   fmt::format("{} views (take each N-th with --every N)", set.views.size()))));

    std::vector<std::vector<ReferenceView>> loaded(set.views.size());
    STX_TRY(LoadedViews all,
            loadEach(set, where, options, set.views.size(), job, failing,
                     [&](std::size_t i, std::vector<ReferenceView> views) -> Result<void> {
                         loaded[i] = std::move(views);
                         return {};
                     }));
    leaveOut(all, set, job);
    Bundle bundle;
    bundle.title = std::move(set.title);
    for (std::vector<ReferenceView>& views : loaded)
        for (ReferenceView& view : views) bundle.views.push_back(std::move(view));
    makeNamesUnique(bundle.views);
    makeAllLinear(bundle.views);
    if (!set.environment.empty()) {
        STX_TRY(bundle.environment, readEnvironmentExr(set.environment, job));
    }
    std::vector<Bounds> each(bundle.views.size());
    parallelFor(0, static_cast<std::int64_t>(each.size()), [&](std::int64_t i) {
        const auto at = static_cast<std::size_t>(i);
        each[at] = bundle.views[at].computeBounds();
    });
    bundle.bounds = boundsTogether(each);
    const glm::dvec3 subtracted = findOrigin(bundle, set, job);
    STX_CHECK(attendToPoses(bundle, options, each, subtracted, all.report, job));
    if (auto ok = bundle.check(); !ok) return tl::unexpected(ok.error().at(where));
    if (set.photo && options.photo.behindPercent > 0) {
        const BehindSettings settings{options.photo.behindPercent};
        STX_TRY(const AddedBehind added, within(where, addBehind(bundle, settings, job)));
        job.note(added.note(settings) + "; --behind none leaves it out");
    }
    if (options.refined) options.refined(all.report);
    return bundle;
}

}  // namespace stx::imagesets
