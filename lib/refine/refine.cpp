#include "lib/refine/refine.hpp"

#include <algorithm>
#include <vector>

#include <fmt/format.h>

#include "lib/refine/refine_depth.hpp"

namespace stx {
namespace {

constexpr std::array<RefineStepInfo, kRefineSteps> kSteps{{
    {RefineStep::pinholes, "pinholes",
     "single pixels that a sensor missed get the depth of the surface around them", ""},
    {RefineStep::noise, "noise", "noisy depth becomes that of the planes that fit it",
     "Goldenshluger & Nemirovski 1997"},
    {RefineStep::edges, "edges",
     "surfaces lose the pixels by which they reach over what is behind them", ""},
    {RefineStep::silhouettes, "silhouettes",
     "noisy points that other views see past move to where the fewest do", "Laurentini 1994"},
    {RefineStep::agree, "agree",
     "noisy points move to the mean of the views that show the same surface", ""},
    {RefineStep::colours, "colours", "noisy points move to where views show the same colours",
     "Lucas & Kanade 1981"},
    {RefineStep::strays, "strays",
     "noisy points with too few neighbours on their surface are not known (splat mode only)", ""},
}};

/// Of names with commas between them.
Result<std::vector<RefineStep>> stepsNamed(std::string_view text) {
    std::vector<RefineStep> steps;
    for (std::size_t at = 0; at <= text.size();) {
        const std::size_t end = std::min(text.find(',', at), text.size());
        const std::string_view name = text.substr(at, end - at);
        const auto step = std::find_if(kSteps.begin(), kSteps.end(),
                                       [&](const RefineStepInfo& s) { return s.name == name; });
        if (step == kSteps.end()) {
            std::string names;
            for (const RefineStepInfo& s : kSteps)
                names += (names.empty() ? "" : ", ") + std::string(s.name);
            return fail(ErrorCode::usage,
                        "there is no step '{}' of refining; it is auto, off or some of: {}", name,
                        names);
        }
        steps.push_back(step->step);
        at = end + 1;
    }
    return steps;
}

}  // namespace

const std::array<RefineStepInfo, kRefineSteps>& refineSteps() {
    return kSteps;
}

RefineSettings RefineSettings::none() {
    RefineSettings settings;
    settings.off_.set();
    settings.automatic_ = false;
    return settings;
}

RefineSettings RefineSettings::all() {
    RefineSettings settings;
    settings.off_.reset();
    settings.automatic_ = false;
    return settings;
}

Result<RefineSettings> RefineSettings::from(std::string_view text) {
    if (text == "auto") return RefineSettings();
    if (text == "off") return none();
    RefineSettings settings = none();
    STX_TRY(const auto steps, stepsNamed(text));
    for (const RefineStep step : steps) settings.set(step, true);
    return settings;
}

Result<RefineSettings> RefineSettings::without(std::string_view text) {
    RefineSettings settings;
    STX_TRY(const auto steps, stepsNamed(text));
    for (const RefineStep step : steps) settings.set(step, false);
    return settings;
}

bool RefineReport::changed() const {
    return std::any_of(steps.begin(), steps.end(), [](const auto& s) { return s.pixels > 0; });
}

void RefineReport::add(const RefineReport& other) {
    for (std::size_t i = 0; i < steps.size(); ++i) {
        RefineStepReport& s = steps[i];
        const RefineStepReport& o = other.steps[i];
        const auto moves =
            s.meanMove * static_cast<double>(s.moved) + o.meanMove * static_cast<double>(o.moved);
        s.views += o.views;
        s.pixels += o.pixels;
        s.moved += o.moved;
        s.milliseconds += o.milliseconds;
        s.meanMove = s.moved > 0 ? moves / static_cast<double>(s.moved) : 0;
    }
    noise = std::max(noise, other.noise);
    ownColour = std::min(ownColour, other.ownColour);
}

std::string RefineReport::names() const {
    std::string out;
    for (const RefineStepInfo& info : kSteps)
        if (of(info.step).pixels > 0) out += (out.empty() ? "" : ",") + std::string(info.name);
    return out;
}

std::string RefineReport::note() const {
    return fmt::format("depth was refined ({}); --refine off leaves it as it is", names());
}

std::string RefineReport::text() const {
    std::string out;
    for (const RefineStepInfo& info : kSteps) {
        const RefineStepReport& s = of(info.step);
        if (s.pixels == 0) continue;
        out += fmt::format("{}{}: {} pixels of {} view{}", out.empty() ? "" : "; ", info.name,
                           s.pixels, s.views, s.views == 1 ? "" : "s");
        if (s.meanMove > 0) out += fmt::format(", moved by {:.2f} % on average", 100 * s.meanMove);
    }
    return out;
}

RefineSettings RefineSettings::after(const Refined& had) const {
    if (had.steps.empty()) return *this;
    RefineSettings settings = none();
    settings.set(RefineStep::strays,
                 on(RefineStep::strays) && had.steps.find("strays") == std::string::npos);
    return settings;
}

Result<RefineReport> refine(Bundle& bundle, const RefineSettings& settings, Job& job) {
    STX_CHECK(bundle.check());
    RefineReport report;
    // What is behind everything is of other times: it says nothing of what is in front.
    for (const bool background : {false, true}) {
        std::vector<ReferenceView*> part;
        std::vector<RefineView> views;
        for (ReferenceView& view : bundle.views) {
            if (view.background != background) continue;
            part.push_back(&view);
            views.push_back({&view, &view.texture, &view.depth});
        }
        STX_CHECK(job.checkCancelled());
        RefineReport ofPart;
        auto refined = refineDepth(views, settings, ofPart);
        report.add(ofPart);
        for (std::size_t i = 0; i < part.size(); ++i) {
            refined[i].giveTo(*part[i]);
            if (refined[i].depth) part[i]->depth = std::move(*refined[i].depth);
        }
    }
    if (report.changed() && bundle.bounds) bundle.bounds = bundle.computeBounds();
    return report;
}

}  // namespace stx
