#include "tools/refining.hpp"

#include <algorithm>
#include <cstdint>

#include <fmt/format.h>

#include "formats/any/changed_once.hpp"
#include "formats/any/save.hpp"
#include "formats/files/files.hpp"
#include "lib/refine/refine_needed.hpp"

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

/// checkPeak() of all views of a table in memory.
Result<void> checkPeakOfAll(const PeakMemory& step, const ViewTable& views, const Limits& limits) {
    std::uint64_t pixels = 0, largest = 0, held = 0;
    for (std::size_t i = 0; i < views.count(); ++i) {
        pixels += views.pixelsOf(i);
        largest = std::max(largest, views.pixelsOf(i));
        held += views.bytesGiven(i);
    }
    return checkPeak(step, pixels, largest, held, limits);
}

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
    // Before the work, and not after it.
    STX_CHECK(checkPeak(mostOf(then), bundle.views, job.limits));
    STX_TRY(const auto report, stx::refine(bundle, settings, job));
    if (report.changed()) job.note(report.note());
    return {};
}

Result<std::unique_ptr<Sequence>> refined(std::unique_ptr<Sequence> frames, const std::string& text,
                                          const PeakMemory& then,
                                          const std::filesystem::path& keepIn) {
    STX_TRY(const auto settings, refineSettings(text));
    if (!settings.any()) return frames;
    const PeakMemory most = mostOf(then);
    const auto refine = [settings, then](Bundle& bundle, Job& job) -> Result<void> {
        return refineViews(bundle, settings, then, job);
    };
    const auto needed = [settings, most](const ViewTable& views, Job& job) -> Result<bool> {
        auto found = mayRefine(views, settings, job);
        // Where a view alone is too large, the limit that is named is enough for what follows, too.
        if (!found) STX_CHECK(checkPeakOfAll(most, views, job.limits));
        return found;
    };
    return keepIn.empty() ? changed(std::move(frames), refine, needed)
                          : changedOnce(std::move(frames), refine, keepIn);
}

std::unique_ptr<Sequence> changedOnTheWay(
    std::unique_ptr<Sequence> frames, const std::filesystem::path& target,
    std::function<Result<void>(Bundle& frame, Job& job)> change) {
    const auto container = containerOf(target);
    if (frames->timeline().moves() && container && *container == FileKind::mpeg4)
        return changedOnce(std::move(frames), std::move(change), folderOf(target));
    return changed(std::move(frames), std::move(change));
}

void Refining::import(ImageSetOptions& options) {
    options.refine = settings_;
    options.refined = [this](const RefineReport& found) {
        imported_ = true;
        atImport_ = found;
    };
}

Result<void> Refining::refine(Bundle& bundle, Job& job) {
    if (!imported_) STX_CHECK(checkNoImport(settings_));
    STX_TRY(const auto found,
            stx::refine(bundle, imported_ ? settings_.afterImport() : settings_, job));
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

Result<void> ImportRefining::refine(Bundle& bundle, bool imported, Job& job) const {
    STX_TRY(RefineSettings settings, RefineSettings::from(steps));
    settings = settings.asked();
    for (const RefineStepInfo& info : refineSteps())
        if (!imported && info.when == RefineWhen::import &&
            settings.of(info.step) == RefineSwitch::on)
            job.note(
                fmt::format("the step '{}' of refining is of image sets and was not done: the "
                            "input is none",
                            info.name));
    if (imported) settings = settings.afterImport();
    if (!settings.any()) return {};
    STX_TRY(const auto report, stx::refine(bundle, settings, job));
    if (report.changed()) job.note("refined: " + report.text());
    return {};
}

void addImportRefining(Command& command, ImportRefining& refining, const char* sets) {
    command
        .option("--refine", refining.steps,
                "Steps of refining (see stx refine): auto (what image sets of a kind are known to "
                "need), off, these only, or auto,STEP,-STEP (this one, too, and not that one)")
        .takes("auto|off|STEPS");
    const auto step = [&](const char* name, RefineStep of, const char* on, const char* off,
                          const char* help) {
        command
            .choice<RefineSwitch>(
                name, refining.switches[static_cast<std::size_t>(of)],
                {{"auto", RefineSwitch::automatic},
                 {on, RefineSwitch::on},
                 {off, RefineSwitch::off}},
                std::string(help) + "; the step " + std::string(infoOf(of).name) + " of --refine")
            .group(sets);
    };
    step("--mixed-pixels", RefineStep::mixed, "drop", "keep",
         "Flying points at depth edges: auto (dropped from sensors' depth), drop, keep");
    command
        .choice<RefineSwitch>(
            "--view-size", refining.switches[static_cast<std::size_t>(RefineStep::raise)],
            {{"picture", RefineSwitch::on}, {"depth", RefineSwitch::off}},
            "Of views whose depth is smaller than their picture: picture (the depth is raised "
            "along the picture's edges) or depth (default picture); the step raise of --refine")
        .group(sets);
    command
        .flag("--refine-poses", refining.poses,
              "Move the cameras so that overlapping views agree in depth and colour; the step "
              "poses of --refine")
        .group(sets);
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
