#include "lib/refine/refine.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "lib/base/cpu_clock.hpp"
#include "lib/model/peak_memory.hpp"
#include "lib/refine/exposure.hpp"
#include "lib/refine/poses.hpp"
#include "lib/refine/refine_depth.hpp"
#include "lib/surface/normals.hpp"

namespace stx {
namespace {

using enum RefineStep;
using enum RefineAuto;

constexpr auto kImport = RefineWhen::import, kRefine = RefineWhen::refine, kBoth = RefineWhen::both;
constexpr const char* kFound = "where it is found";

// clang-format off
constexpr std::array<RefineStepInfo, kRefineSteps> kSteps{{
    {steps, "steps", kImport, known, "8-bit depth, and up to 12 bits where codes are coarse",
     "stairs of depth in coarse codes are smoothed within half a step", ""},
    {shift, "shift", kImport, known, "Middlebury 2003 to 2006",
     "disparities and rows that are a part of a pixel off move to where other pictures of the set show them", ""},
    {reproject, "reproject", kImport, known, "7-Scenes; depth cameras that are given",
     "depth that a camera of its own took is seen from the colour camera", ""},
    {mixed, "mixed", kBoth, known, "sensors and reconstructions (TUM, 7-Scenes, COLMAP)",
     "pixels that hang between two surfaces are not known", ""},
    {raise, "raise", kImport, known, "depth smaller than its picture",
     "depth gets the size of its picture, along the picture's edges", ""},
    {gaps, "gaps", kBoth, known, "older Middlebury sets",
     "pixels without depth get that of the surface whose colours lead there", ""},
    {align, "align", kBoth, known, "older Middlebury sets",
     "edges of depth move to where the picture has them", ""},
    {poses, "poses", kBoth, known, "sets with missing depth, where colours tell",
     "cameras move so that overlapping views agree in depth and colour", "Newcombe et al. 2011"},
    {exposure, "exposure", kRefine, found, kFound,
     "colours of cameras that expose for themselves are matched", ""},
    {noise, "noise", kRefine, found, kFound,
     "noisy depth becomes that of the planes that fit it", "Goldenshluger & Nemirovski 1997"},
    {edges, "edges", kRefine, found, kFound,
     "surfaces lose the pixels by which they reach over what is behind them", ""},
    {silhouettes, "silhouettes", kRefine, found, kFound,
     "noisy points that other views see past move to where the fewest do", "Laurentini 1994"},
    {agree, "agree", kRefine, found, kFound,
     "noisy points move to the mean of the views that show the same surface", ""},
    {colours, "colours", kRefine, found, kFound,
     "noisy points move to where views show the same colours", "Lucas & Kanade 1981"},
    {strays, "strays", kRefine, splats, "in splat mode",
     "noisy points with too few neighbours on their surface are not known", ""},
}};
// clang-format on

Result<RefineStep> stepNamed(std::string_view name) {
    const auto step = std::find_if(kSteps.begin(), kSteps.end(),
                                   [&](const RefineStepInfo& s) { return s.name == name; });
    if (step != kSteps.end()) return step->step;
    std::string names;
    for (const RefineStepInfo& s : kSteps)
        names += (names.empty() ? "" : ", ") + std::string(s.name);
    return fail(ErrorCode::usage,
                "there is no step '{}' of refining; it is auto, off or some of: {}", name, names);
}

/// Matches the colours of some views of a bundle.
void matchExposure(const std::vector<ReferenceView*>& views, RefineStepReport& report) {
    if (views.size() < 2) return;
    const double start = processMilliseconds();
    std::vector<Camera> cameras;
    for (const ReferenceView* view : views) cameras.push_back(view->camera);
    const auto maps = exposureMaps(cameras, [&](std::size_t k, int, int, int, int) {
        return PixelPart{&views[k]->texture, &views[k]->depth, 0, 1, views[k]->camera.width};
    });
    for (std::size_t k = 0; k < views.size(); ++k) {
        if (maps[k].changesNothing()) continue;
        ReferenceView& view = *views[k];
        ++report.views;
        applyMap(maps[k], 0, 0, view.camera.width, view.camera.height, view.texture, report);
    }
    report.milliseconds += processMilliseconds() - start;
}

}  // namespace

const std::array<RefineStepInfo, kRefineSteps>& refineSteps() {
    return kSteps;
}

const RefineStepInfo& infoOf(RefineStep step) {
    return kSteps[static_cast<std::size_t>(step)];
}

bool RefineSettings::on(RefineStep step) const {
    const RefineStepInfo& info = infoOf(step);
    if (info.when == RefineWhen::import) return false;
    if (of(step) != RefineSwitch::automatic) return of(step) == RefineSwitch::on;
    return info.automatic == found || (info.automatic == RefineAuto::splats && splats_);
}

bool RefineSettings::any() const {
    return std::any_of(kSteps.begin(), kSteps.end(), [&](const auto& s) { return on(s.step); });
}

RefineSettings RefineSettings::asked() const {
    RefineSettings settings = *this;
    for (RefineSwitch& to : settings.switches_)
        if (to == RefineSwitch::automatic) to = RefineSwitch::off;
    return settings;
}

RefineSettings RefineSettings::afterImport() const {
    RefineSettings settings = *this;
    for (const RefineStepInfo& info : kSteps)
        if (info.when == RefineWhen::both) settings.set(info.step, false);
    return settings;
}

bool wasDone(RefineStep step, const Refined& had) {
    const std::string_view names = had.steps, name = infoOf(step).name;
    for (std::size_t at = 0; at <= names.size();) {
        const std::size_t end = std::min(names.find(',', at), names.size());
        if (names.substr(at, end - at) == name) return true;
        at = end + 1;
    }
    return false;
}

RefineSettings RefineSettings::after(const Refined& had) const {
    if (had.steps.empty()) return *this;
    const bool measured = std::any_of(kSteps.begin(), kSteps.end(), [&](const auto& info) {
        return info.automatic == found && wasDone(info.step, had);
    });
    RefineSettings settings = *this;
    for (const RefineStepInfo& info : kSteps)
        if (info.automatic == found ? measured : wasDone(info.step, had))
            settings.set(info.step, false);
    return settings;
}

RefineSettings RefineSettings::none() {
    RefineSettings settings;
    settings.switches_.fill(RefineSwitch::off);
    settings.set(reproject, RefineSwitch::automatic);
    return settings;
}

RefineSettings RefineSettings::all() {
    RefineSettings settings = none();
    for (const RefineStepInfo& info : kSteps)
        if (info.automatic == found || info.automatic == RefineAuto::splats)
            settings.set(info.step, true);
    return settings;
}

Result<RefineSettings> RefineSettings::from(std::string_view text) {
    const bool more = text.starts_with("auto,");
    if (text == "auto") return RefineSettings();
    if (text == "off") return none();
    RefineSettings settings = more ? RefineSettings() : none();
    for (std::size_t at = more ? 5 : 0; at <= text.size();) {
        const std::size_t end = std::min(text.find(',', at), text.size());
        std::string_view name = text.substr(at, end - at);
        const bool off = more && name.starts_with('-');
        if (off) name.remove_prefix(1);
        STX_TRY(const RefineStep step, stepNamed(name));
        settings.set(step, !off);
        at = end + 1;
    }
    return settings;
}

void RefineStepReport::add(const RefineStepReport& other) {
    const auto moves =
        meanMove * static_cast<double>(moved) + other.meanMove * static_cast<double>(other.moved);
    views += other.views;
    pixels += other.pixels;
    moved += other.moved;
    milliseconds += other.milliseconds;
    meanMove = moved > 0 ? moves / static_cast<double>(moved) : 0;
}

bool RefineReport::changed() const {
    return std::any_of(steps.begin(), steps.end(), [](const auto& s) { return s.views > 0; });
}

void RefineReport::add(const RefineReport& other) {
    for (std::size_t i = 0; i < steps.size(); ++i) steps[i].add(other.steps[i]);
    noise = std::max(noise, other.noise);
    ownColour = std::min(ownColour, other.ownColour);
}

std::string RefineReport::names() const {
    std::string out;
    for (const RefineStepInfo& info : kSteps)
        if (of(info.step).views > 0) out += (out.empty() ? "" : ",") + std::string(info.name);
    return out;
}

void RefineReport::record(Refined& view) const {
    if (!changed()) return;
    view.steps += (view.steps.empty() ? "" : ",") + names();
}

std::string RefineReport::note() const {
    return fmt::format("views were refined ({}); --refine off leaves them as they are", names());
}

std::string RefineReport::text() const {
    std::string out;
    for (const RefineStepInfo& info : kSteps) {
        const RefineStepReport& s = of(info.step);
        if (s.views == 0) continue;
        out += fmt::format("{}{}: ", out.empty() ? "" : "; ", info.name);
        if (s.pixels > 0) out += fmt::format("{} pixels of ", s.pixels);
        out += fmt::format("{} view{}", s.views, s.views == 1 ? "" : "s");
        if (s.meanMove > 0)
            out += fmt::format(", {} by {:.2f} % on average",
                               info.step == exposure ? "changed" : "moved", 100 * s.meanMove);
    }
    return out;
}

namespace {

Result<RefineReport> refineIn(const RefineRoom& room, Bundle& bundle,
                              const RefineSettings& settings, Job& job) {
    RefineReport report, ofAll;
    RefineSettings once = settings;
    for (const ReferenceView& view : bundle.views) once = once.after(view.refined);
    if (once.on(poses)) STX_SET(ofAll.of(poses), alignPoses(bundle, AlignPoses::asked, job));
    report.add(ofAll);
    // What is behind everything is of other times: it says nothing of what is in front.
    for (const bool background : {false, true}) {
        std::vector<ReferenceView*> part;
        for (ReferenceView& view : bundle.views)
            if (view.background == background) part.push_back(&view);
        if (part.empty()) continue;
        STX_CHECK(job.checkCancelled());
        RefineSettings left = settings;
        for (const ReferenceView* view : part) left = left.after(view->refined);
        RefineReport ofPart;
        // The light of what is behind is that of its cameras in front: when it is drawn.
        if (left.on(exposure) && (!background || part.size() == bundle.views.size()))
            matchExposure(part, ofPart.of(exposure));
        std::vector<RefineView> views;
        for (ReferenceView* view : part) views.push_back({view, &view->texture, &view->depth});
        auto refined = refineDepth(views, left, ofPart, room);
        report.add(ofPart);
        ofPart.add(ofAll);
        for (std::size_t i = 0; i < part.size(); ++i) {
            ofPart.record(refined[i].refined);
            refined[i].giveTo(*part[i]);
            if (!refined[i].depth) continue;
            if (room.spool) room.spool->settle();
            const Image<float> was = std::exchange(part[i]->depth, std::move(*refined[i].depth));
            renewSurface(*part[i], was);
        }
    }
    if (report.changed() && bundle.bounds) bundle.bounds = bundle.computeBounds();
    return report;
}

}  // namespace

Result<RefineReport> refine(Bundle& bundle, const RefineSettings& settings, Job& job) {
    STX_CHECK(bundle.check());
    STX_CHECK(checkPeak(peak::kRefine, bundle.views, job.limits));
    return refineIn({}, bundle, settings, job);
}

Result<RefineReport> refine(Bundle& bundle, const RefineSettings& settings, PixelSpool& spool,
                            Job& job) {
    STX_CHECK(bundle.check());
    std::uint64_t largest = 0;
    for (const ReferenceView& view : bundle.views)
        largest = std::max<std::uint64_t>(largest, view.depth.count());
    STX_TRY(const RefineRoom room, roomIn(spool, largest, job.limits));
    return refineIn(room, bundle, settings, job);
}

}  // namespace stx
