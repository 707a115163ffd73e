#include "tools/refining.hpp"

#include <algorithm>
#include <cstdint>

#include <fmt/format.h>

#include "formats/any/changed_once.hpp"
#include "formats/any/save.hpp"
#include "formats/files/file_spool.hpp"
#include "formats/files/files.hpp"
#include "lib/refine/refine_needed.hpp"
#include "tools/peak_of_views.hpp"

namespace stx::tools {
namespace {

/// Errors (usage) for steps that were asked for, and that only an import can do.
Result<void> checkNoImport(const RefineSettings& settings) {
    for (const RefineStepInfo& info : refineSteps())
        if (info.when == RefineWhen::import && settings.of(info.step) == RefineSwitch::on)
            return fail(
                ErrorCode::usage,
                "the step '{}' needs what only an import knows (depth as it was stored, its "
                "camera); have it done there: stx convert SET --refine {}",
                info.name, info.name);
    return {};
}

/// Of refining, and of what follows.
PeakMemory mostOf(const PeakMemory& then) {
    const bool thenMore = then.perPixel + then.perPixelOfLargest > peak::kRefine.perPixel;
    return thenMore ? then : peak::kRefine;
}

/// Whether refining takes less memory with the views in a spool. Small captures do not.
bool takesLessInSpool(const ViewTable& views, const Limits& limits) {
    return !views.whole() &&
           memoryFromSpool(views, peak::kRefine, limits) < memoryOfAll(views, peak::kRefine);
}

/// Errors (invalidInput) where refining one view beside a spool takes more than the limit.
Result<void> checkRoomBesideSpool(const ViewTable& views, const Limits& limits) {
    std::uint64_t most = 0, pixels = 0;
    for (std::size_t i = 0; i < views.count(); ++i) {
        most = std::max({most, views.bytesToMake(i),
                         views.bytesGiven(i) + peak::kRefine.perPixel * views.pixelsOf(i)});
        pixels += views.pixelsOf(i);
    }
    const std::uint64_t beside = views.bytesHeld() + most;
    return checkPeak({peak::kRefine.what, 0}, pixels, 0, beside + beside / (kSpoolPart - 1),
                     limits);
}

Result<RefineReport> refineIn(PixelSpool* spool, Bundle& bundle, const RefineSettings& settings,
                              Job& job) {
    return spool ? stx::refine(bundle, settings, *spool, job) : stx::refine(bundle, settings, job);
}

/// Refines, in a spool if it is not null; a note says what was done.
Result<void> refineAsAsked(Bundle& bundle, const RefineSettings& settings, PixelSpool* spool,
                           Job& job) {
    if (!settings.any()) return {};
    STX_TRY(const auto report, refineIn(spool, bundle, settings, job));
    if (report.changed()) job.note("refined: " + report.text());
    return {};
}

/// What refineViews() does, in a spool if it is not null.
Result<void> refineFor(const PeakMemory& then, const RefineSettings& settings, Bundle& bundle,
                       PixelSpool* spool, Job& job) {
    // Before the work, and not after it. From a spool what follows takes views one by one.
    if (!spool) STX_CHECK(checkPeak(mostOf(then), bundle.views, job.limits));
    STX_TRY(const auto report, refineIn(spool, bundle, settings, job));
    if (report.changed()) job.note(report.note());
    return {};
}

class RefinedFrames : public Sequence {
  public:
    RefinedFrames(std::unique_ptr<Sequence> frames, const RefineSettings& settings,
                  const PeakMemory& then, std::filesystem::path folder)
        : frames_(std::move(frames)), settings_(settings), then_(then), folder_(std::move(folder)) {
        timeline_ = frames_->timeline();
    }
    Result<Bundle> frame(std::size_t index, Job& job) override {
        STX_TRY(auto bundle, frames_->frame(index, job));
        STX_CHECK(refineFor(then_, settings_, bundle, nullptr, job));
        return bundle;
    }
    Result<std::unique_ptr<ViewTable>> views(std::size_t index, Job& job) override {
        STX_TRY(auto table, frames_->views(index, job));
        const auto refine = [this](Bundle& bundle, PixelSpool* spool, Job& own) {
            return refineFor(then_, settings_, bundle, spool, own);
        };
        // Where a view alone is too large, the limit that is named is enough for what follows, too.
        if (!table->whole() && !takesLessInSpool(*table, job.limits) &&
            memoryOfEach(*table, peak::kRefine) > job.limits.maxMemoryBytes)
            STX_CHECK(checkPeakOfAll(mostOf(then_), *table, job.limits));
        return refinedViews(std::move(table), settings_, refine, true, folder_, job);
    }

  private:
    std::unique_ptr<Sequence> frames_;
    RefineSettings settings_;
    PeakMemory then_;
    std::filesystem::path folder_;
};

}  // namespace

Option refineOption(Command& command, std::string& text) {
    std::string names;
    for (const RefineStepInfo& step : refineSteps())
        if (step.when != RefineWhen::import)
            names += (names.empty() ? "" : ",") + std::string(step.name);
    return command
        .option("--refine", text,
                "Views are refined first: auto (where they are not exact), off, these steps only, "
                "or auto,STEP,-STEP (this one, too, and not that one): " +
                    names + " (see stx refine; default auto)")
        .takes("auto|off|STEPS");
}

Result<RefineSettings> refineSettings(const std::string& text) {
    STX_TRY(const auto settings, RefineSettings::from(text));
    STX_CHECK(checkNoImport(settings));
    return settings;
}

Result<void> refineViews(Bundle& bundle, const RefineSettings& settings, const PeakMemory& then,
                         Job& job) {
    if (!settings.any()) return {};
    return refineFor(then, settings, bundle, nullptr, job);
}

Result<void> refineViews(Bundle& bundle, const RefineSettings& settings, PixelSpool& spool,
                         Job& job) {
    return refineFor(peak::kRefine, settings, bundle, &spool, job);
}

Result<std::unique_ptr<Sequence>> refined(std::unique_ptr<Sequence> frames, const std::string& text,
                                          const PeakMemory& then,
                                          const std::filesystem::path& folder) {
    STX_TRY(const auto settings, refineSettings(text));
    if (!settings.any()) return frames;
    return std::make_unique<RefinedFrames>(std::move(frames), settings, then, folder);
}

Result<std::unique_ptr<Sequence>> refinedOnce(std::unique_ptr<Sequence> frames,
                                              const std::string& text, const PeakMemory& then,
                                              const std::filesystem::path& folder) {
    STX_TRY(const auto settings, refineSettings(text));
    if (!settings.any()) return frames;
    const auto refine = [settings, then](Bundle& bundle, Job& job) -> Result<void> {
        return refineViews(bundle, settings, then, job);
    };
    return changedOnce(std::move(frames), refine, folder);
}

Result<std::unique_ptr<ViewTable>> refinedViews(std::unique_ptr<ViewTable> table,
                                                const RefineSettings& settings,
                                                const RefineBundle& refine, bool looksFirst,
                                                const std::filesystem::path& folder, Job& job) {
    const bool spooled = takesLessInSpool(*table, job.limits);
    if (!table->whole() && (spooled || looksFirst)) {
        auto needed = mayRefine(*table, settings, job);
        if (needed && !*needed) return table;
        // Where one view is too large, the limit that is named is enough for a spool, too.
        if (spooled) STX_CHECK(checkRoomBesideSpool(*table, job.limits));
        if (!needed) return propagate(needed);
    }
    if (!spooled) {
        STX_TRY(auto bundle, wholeBundle(std::move(table), job));
        STX_CHECK(refine(bundle, nullptr, job));
        return tableOf(std::move(bundle));
    }
    const std::uint64_t held = job.limits.maxMemoryBytes / kSpoolPart;
    STX_TRY(auto spool, FileSpool::create(folder, held));
    Job beside;  // what the spool takes is not there for others
    beside.workFor(job);
    beside.onProgress = job.onProgress;
    beside.limits.maxMemoryBytes -= held;
    STX_TRY(auto bundle, wholeBundle(*table, *spool, beside));
    STX_CHECK(refine(bundle, spool.get(), beside));
    beside.passNotesOn();
    return tableOf(std::move(bundle), std::move(spool), held);
}

std::unique_ptr<Sequence> changedOnTheWay(
    std::unique_ptr<Sequence> frames, const std::filesystem::path& target,
    std::function<Result<void>(Bundle& frame, Job& job)> change) {
    const auto container = containerOf(target);
    if (frames->timeline().moves() && container && *container == FileKind::mpeg4)
        return changedOnce(std::move(frames), std::move(change), folderBeside(target));
    return changed(std::move(frames), std::move(change));
}

void Refining::import(ImageSetOptions& options) {
    options.refine = settings_;
    options.refined = [this](const RefineReport& found) {
        imported_ = true;
        atImport_ = found;
    };
}

Result<void> Refining::check() const {
    return imported_ ? Result<void>() : checkNoImport(settings_);
}

Result<void> Refining::refine(Bundle& bundle, PixelSpool* spool, Job& job) {
    STX_CHECK(check());
    STX_TRY(const auto found, refineIn(spool, bundle, left(), job));
    report_.add(found);
    report_.add(atImport_);
    return {};
}

Result<RefineSettings> ImportRefining::settings() const {
    STX_TRY(auto settings, RefineSettings::from(steps));
    for (const RefineStepInfo& info : refineSteps())
        if (const auto to = switches[static_cast<std::size_t>(info.step)];
            to != RefineSwitch::automatic)
            settings.set(info.step, to);
    if (poses) settings.set(RefineStep::poses, true);
    return settings;
}

Result<RefineSettings> ImportRefining::left(bool imported, Job& job) const {
    STX_TRY(RefineSettings settings, RefineSettings::from(steps));
    settings = settings.asked();
    for (const RefineStepInfo& info : refineSteps())
        if (!imported && info.when == RefineWhen::import &&
            settings.of(info.step) == RefineSwitch::on)
            job.note(
                fmt::format("the step '{}' of refining is of image sets and was not done: the "
                            "input is none",
                            info.name));
    return imported ? settings.afterImport() : settings;
}

Result<void> ImportRefining::refine(Bundle& bundle, bool imported, Job& job) const {
    STX_TRY(const auto settings, left(imported, job));
    return refineAsAsked(bundle, settings, nullptr, job);
}

Result<std::unique_ptr<ViewTable>> ImportRefining::refined(std::unique_ptr<ViewTable> table,
                                                           bool imported,
                                                           const std::filesystem::path& folder,
                                                           Job& job) const {
    STX_TRY(const auto settings, left(imported, job));
    if (!settings.any()) return table;
    const auto refine = [&](Bundle& bundle, PixelSpool* spool, Job& own) {
        return refineAsAsked(bundle, settings, spool, own);
    };
    return refinedViews(std::move(table), settings, refine, false, folder, job);
}

void addImportRefining(Command c, ImportRefining& refining, const char* heading) {
    c.option("--refine", refining.steps,
             "Steps of refining (see stx refine): auto (what image sets of a kind are known to "
             "need), off, these only, or auto,STEP,-STEP (this one, too, and not that one)")
        .takes("auto|off|STEPS");
    c = c.under(heading);
    const auto step = [&](const char* name, RefineStep of, const char* on, const char* off,
                          const char* help) {
        c.choice<RefineSwitch>(
            name, refining.switches[static_cast<std::size_t>(of)],
            {{"auto", RefineSwitch::automatic}, {on, RefineSwitch::on}, {off, RefineSwitch::off}},
            std::string(help) + "; the step " + std::string(infoOf(of).name) + " of --refine");
    };
    step("--mixed-pixels", RefineStep::mixed, "drop", "keep",
         "Flying points at depth edges: auto (dropped from sensors' depth), drop, keep");
    c.choice<RefineSwitch>(
        "--view-size", refining.switches[static_cast<std::size_t>(RefineStep::raise)],
        {{"picture", RefineSwitch::on}, {"depth", RefineSwitch::off}},
        "Of views whose depth is smaller than their picture: picture (the depth is raised "
        "along the picture's edges) or depth (default picture); the step raise of --refine");
    c.flag("--refine-poses", refining.poses,
           "Move the cameras so that overlapping views agree in depth and colour; the step "
           "poses of --refine");
    step("--dequantise", RefineStep::steps, "on", "off",
         "Smooth the stairs of depth stored in integers, within half a step: auto (8-bit "
         "depth), on, off");
    step("--close-gaps", RefineStep::gaps, "on", "off",
         "Give pixels without depth, up to a fiftieth of the picture's longer side from known "
         "ones, that of the surface whose colours lead there: auto (older Middlebury sets), on, "
         "off");
    step("--align-edges", RefineStep::align, "on", "off",
         "Move depth edges to where the picture has them, by up to 2 pixels: auto (older "
         "Middlebury sets), on, off");
}

}  // namespace stx::tools
