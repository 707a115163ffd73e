#include "lib/render/factory.hpp"

#include <algorithm>

#include "lib/model/view_table.hpp"
#include "lib/refine/refine_depth.hpp"
#include "lib/render/compose/behind.hpp"
#include "lib/render/compose/environment_behind.hpp"
#include "lib/render/compose/fallback.hpp"
#include "lib/render/compose/footprint.hpp"
#include "lib/render/scene/page_set.hpp"
#include "lib/render/splat/cpu/cpu_splat.hpp"
#include "lib/render/surface/cpu/cpu_surface.hpp"
#include "lib/render/surface/plan/needed_views.hpp"
#include "lib/render/surface/prepare/summary.hpp"
#ifdef STX_WITH_GPU
#include "lib/render/device/egl_context.hpp"
#include "lib/render/splat/gl/gl_renderer.hpp"
#include "lib/render/splat/gpu/gpu_splat.hpp"
#include "lib/render/surface/gpu/gpu_surface.hpp"
#endif

namespace stx {
namespace {

/// A renderer of splats, and another of the views behind them.
template <class Make>
Result<std::unique_ptr<Renderer>> splatsBefore(const PageSet& set, const Make& make) {
    STX_TRY(std::unique_ptr<Renderer> front, Result<std::unique_ptr<Renderer>>(make(set)));
    if (!set.behind()) return front;
    STX_TRY(std::unique_ptr<Renderer> behind, splatsBefore(*set.behind(), make));
    return withBackground(std::move(front), std::move(behind), set.behind()->farAway());
}

Result<std::unique_ptr<Renderer>> makeCpu(const PageSet& set, const RenderSettings& settings,
                                          Job& job) {
    if (settings.mode == RenderMode::splat)
        return splatsBefore(
            set, [&](const PageSet& s) { return makeCpuSplatRenderer(s, settings, job); });
    return makeCpuSurfaceRenderer(set, settings, job);
}

struct DeviceChoice {
    bool exists = true, hardware = false;
};

#ifdef STX_WITH_GPU
Result<std::unique_ptr<Renderer>> makeGpu(const PageSet& set, const RenderSettings& settings,
                                          int device, Job& job) {
    if (settings.mode == RenderMode::surface)
        return gpu::makeGpuSurfaceRenderer(set, settings, device, job);
    return splatsBefore(
        set, [&](const PageSet& s) { return gpu::makeGpuSplatRenderer(s, settings, device, job); });
}

Result<std::unique_ptr<Renderer>> makeGl(const PageSet& set, const RenderSettings& settings,
                                         int device, Job& job) {
    if (settings.mode == RenderMode::surface)
        return fail(ErrorCode::unsupported,
                    "the gl backend draws splats only; use --mode splat or --backend cpu");
    return splatsBefore(
        set, [&](const PageSet& s) { return gl::makeGlRenderer(s, settings, device, job); });
}

/// What is known of the device asked for; -1: of all.
DeviceChoice deviceChoice(int device) {
    if (device == -1 && !gpu::mayHaveHardware()) return {};
    std::vector<std::string> tried;
    const auto devices = gpu::enumerateDevices(tried);
    if (device == -1)
        return {true, std::any_of(devices.begin(), devices.end(),
                                  [](const Device& d) { return !d.software; })};
    if (device < 0 || device >= static_cast<int>(devices.size())) return {false, false};
    return {true, !devices[device].software};
}
#else
constexpr const char* kNoGpu =
    "this build has no {} backend (STX_WITH_GPU was off); use --backend cpu";

Result<std::unique_ptr<Renderer>> makeGpu(const PageSet&, const RenderSettings&, int, Job&) {
    return fail(ErrorCode::unsupported, kNoGpu, "gpu");
}
Result<std::unique_ptr<Renderer>> makeGl(const PageSet&, const RenderSettings&, int, Job&) {
    return fail(ErrorCode::unsupported, kNoGpu, "gl");
}
DeviceChoice deviceChoice(int device) {
    return {device == -1, false};
}
#endif

}  // namespace

namespace {

/// Points of one pixel, the paper's rule and conventional OpenGL stay what they are.
bool isOurs(Backend backend, const RenderSettings& settings) {
    if (settings.mode == RenderMode::surface) return true;
    return settings.splat == SplatRule::data && backend != Backend::gl;
}

Result<std::unique_ptr<Renderer>> makePlain(Backend backend, const PageSet& set,
                                            const RenderSettings& settings, int device, Job& job) {
    switch (backend) {
        case Backend::gpu:
            return makeGpu(set, settings, device, job);
        case Backend::gl:
            return makeGl(set, settings, device, job);
        case Backend::cpu:
            return makeCpu(set, settings, job);
        case Backend::automatic:
            break;
    }
    const DeviceChoice choice = deviceChoice(device);
    // Fails, and says which devices there are.
    if (!choice.exists) return makeGpu(set, settings, device, job);
    if (choice.hardware) {
        auto made = makeGpu(set, settings, device, job);
        if (made)
            return withFallback(
                std::move(*made), [set, settings, &job] { return makeCpu(set, settings, job); },
                job);
        job.note(fmt::format("the gpu backend cannot be used ({}); the cpu backend draws instead",
                             made.error().text()));
    }
    return makeCpu(set, settings, job);
}

/// The views that show what is there now, before the background when it is wanted. A set of
/// background views only is drawn as any other.
PageSet inFront(const PageSet& set, const RenderSettings& settings, Job& job) {
    const auto matched = [&](const PageSet& views) {
        RefineStepReport report;
        PageSet alike = views.inOneLight(settings.refine, report);
        if (settings.log && report.milliseconds > 0)
            settings.log->add("exposure", report.milliseconds, report.pixels, true);
        if (report.views > 0)
            job.note(
                fmt::format("colours of {} of {} views were matched to those of the others "
                            "(gain and offset); --match-colours off leaves them as they are",
                            report.views, views.views().size()));
        return alike;
    };
    const auto views = set.views();
    const auto isBackground = [](const PageView& v) { return v.background; };
    if (std::none_of(views.begin(), views.end(), isBackground) ||
        std::all_of(views.begin(), views.end(), isBackground))
        return matched(set);
    PageSet front = matched(set.part(false));
    if (settings.fill != Fill::background) return front;
    return front.before(set.part(true).inLightOf(front));
}

/// The environment that is shown behind what has this one; null: none.
Result<std::shared_ptr<const EnvironmentMap>> environmentOf(
    const RenderSettings& settings, const std::shared_ptr<const Environment>& own, Job& job) {
    if (settings.environment || !settings.ownEnvironment || !own) return settings.environment;
    return EnvironmentMap::make(*own, job.limits);
}

Result<std::unique_ptr<Renderer>> makeFrom(Backend backend, const PageSet& set,
                                           const RenderSettings& wanted,
                                           const std::shared_ptr<const Environment>& own,
                                           int device, Job& job) {
    STX_CHECK(wanted.check());
    STX_TRY(const auto environment, environmentOf(wanted, own, job));
    RenderSettings settings = wanted;
    // Alpha inside of the object is not an outline for surfaces to end at.
    bool translucent = false;
    const auto solid = [&](const PageSet& views) {
        if (settings.mode != RenderMode::surface || !settings.does(Stage::solid)) return views;
        const StageTimer timer(settings.log.get(), "solid", true);
        bool changed = false;
        PageSet opaque = views.solid(changed);
        translucent = translucent || changed;
        return opaque;
    };
    if (settings.mode == RenderMode::splat) settings.refine = settings.refine.forSplats();
    const auto refined = [&](const PageSet& views) -> Result<PageSet> {
        std::int64_t atOnce = 0;
        if (views.spool()) {
            // What agrees by itself is looked at one by one.
            if (!views.mayRefine(settings.refine)) return views;
            std::uint64_t largest = 0;
            for (const PageView& view : views.views())
                largest = std::max(largest, static_cast<std::uint64_t>(view.camera.width) *
                                                static_cast<std::uint64_t>(view.camera.height));
            STX_TRY(const RefineRoom room, roomIn(*views.spool(), largest, job.limits));
            atOnce = room.atOnce;
        }
        RefineReport report;
        PageSet better = views.refined(settings.refine, &report, atOnce);
        for (const RefineStepInfo& info : refineSteps())
            if (const RefineStepReport& s = report.of(info.step);
                settings.log && s.milliseconds > 0)
                settings.log->add(info.name, s.milliseconds, s.pixels, true);
        if (report.changed()) job.note(report.note());
        return better;
    };
    PageSet chosen = [&] {
        const StageTimer timer(settings.log.get(), "twins", true);
        return settings.does(Stage::twins) ? set.distinct() : set;
    }();
    if (settings.mode == RenderMode::splat && settings.does(Stage::coarse) &&
        isOurs(backend, settings)) {
        StageTimer timer(settings.log.get(), "coarse", true);
        std::int64_t points = 0;
        chosen = chosen.withoutCoarse(points);
        timer.changed(points);
    }
    const PageSet captured = solid(inFront(chosen, settings, job));
    STX_TRY(PageSet drawn, refined(captured));
    if (drawn.behind()) {
        STX_TRY(PageSet behind, refined(solid(*drawn.behind())));
        drawn = drawn.before(std::move(behind));
    }
    if (settings.fill == Fill::background && settings.does(Stage::unmeasured) &&
        isOurs(backend, settings)) {
        StageTimer timer(settings.log.get(), "unmeasured", true);
        std::int64_t pixels = 0;
        drawn = drawn.withUnmeasured(captured, pixels);
        timer.changed(pixels);
    }
    if (translucent)
        job.note("surface mode draws translucent surfaces opaque; --mode splat keeps their alpha");
    // What is around an open place is a guess; the environment is known.
    if (environment) settings.fill = Fill::none;
    STX_TRY(auto made, makePlain(backend, drawn, settings, device, job));
    if (settings.does(Stage::footprint) && isOurs(backend, settings))
        made = withFootprint(std::move(made), drawn, settings, job);
    if (environment) made = withEnvironment(std::move(made), environment);
    return made;
}

/// checkPeak() of what an atlas is drawn from: its pages, or views that are made of them.
Result<void> checkPeakOf(const PeakMemory& drawing, const Atlas& atlas, const Limits& limits) {
    const AtlasPage& first = atlas.pages[0];
    const ViewImageKinds kinds{first.texture.isLinear(),
                               !first.normal.empty(),
                               !first.splatU.empty(),
                               !first.splatV.empty(),
                               !first.metallicRoughness.empty(),
                               !first.emissive.empty()};
    std::uint64_t inPages = 0, inViews = 0;
    for (const AtlasPage& page : atlas.pages) inPages += page.depth.count();
    if (!atlas.paddingHolds(PageSet::kPadding))
        for (const ReferenceView& view : atlas.views)
            inViews += static_cast<std::uint64_t>(view.camera.width) *
                       static_cast<std::uint64_t>(view.camera.height);
    const std::uint64_t drawn = inViews > 0 ? inViews : inPages;
    return checkPeak(drawing, drawn, drawn, (inPages + inViews) * kinds.bytesPerPixel(), limits);
}

}  // namespace

const PeakMemory& drawingMemory(const RenderSettings& settings) {
    const bool lit = settings.wantNormals();
    if (settings.mode == RenderMode::splat) return lit ? peak::kLitSplatMode : peak::kSplatMode;
    return lit ? peak::kLitSurfaceMode : peak::kSurfaceMode;
}

Result<std::unique_ptr<Renderer>> makeRenderer(Backend backend, const Bundle& bundle,
                                               const RenderSettings& settings, int device,
                                               Job& job) {
    STX_CHECK(bundle.check());
    STX_CHECK(checkPeak(drawingMemory(settings), bundle.views, job.limits));
    return makeFrom(backend, bundle, settings, bundle.environment, device, job);
}

Result<std::unique_ptr<Renderer>> makeRenderer(Backend backend, const Bundle& bundle,
                                               PixelSpool& spool, const RenderSettings& settings,
                                               int device, Job& job) {
    STX_CHECK(bundle.check());
    return makeFrom(backend, PageSet(bundle, spool), settings, bundle.environment, device, job);
}

ViewSummary summaryOfView(const ReferenceView& view) {
    return surface::summaryOf(view);
}

bool mayBeSummaryOf(const ViewSummary& summary, const ReferenceView& view) {
    return surface::mayBeSummaryOf(summary, view);
}

bool tellWithoutPixels(const std::vector<ReferenceView>& views) {
    return std::ranges::all_of(views, surface::tellsWithoutPixels);
}

std::vector<bool> neededViews(Backend backend, int device, const std::vector<ReferenceView>& views,
                              std::span<const ViewSummary> summaries,
                              const RenderSettings& settings, std::span<const Camera> pictures) {
    const DeviceChoice choice = deviceChoice(device);
    const bool onProcessor = backend == Backend::cpu ||
                             (backend == Backend::automatic && choice.exists && !choice.hardware);
    if (!onProcessor) return std::vector<bool>(views.size(), true);
    return surface::neededViews(views, summaries, settings, pictures);
}

Result<std::unique_ptr<Renderer>> makeRenderer(const Bundle& bundle,
                                               std::span<const ViewSummary> summaries,
                                               PixelSpool* spool, const RenderSettings& settings,
                                               Job& job) {
    RenderSettings exact = settings;
    exact.refine = RefineSettings::none();
    return makeFrom(Backend::cpu, PageSet(bundle, summaries, spool), exact, bundle.environment, -1,
                    job);
}

Result<std::unique_ptr<Renderer>> makeRenderer(Backend backend, const Atlas& atlas,
                                               const RenderSettings& settings, int device,
                                               Job& job) {
    STX_TRY(const PageSet set, PageSet::of(atlas, job));
    STX_CHECK(checkPeakOf(drawingMemory(settings), atlas, job.limits));
    return makeFrom(backend, set, settings, atlas.environment, device, job);
}

std::vector<Device> listDevices(Job& job) {
#ifdef STX_WITH_GPU
    std::vector<std::string> tried;
    auto devices = gpu::enumerateDevices(tried);
    if (devices.empty()) {
        std::string text;
        for (const auto& t : tried) text += (text.empty() ? "" : "; ") + t;
        job.note("no OpenGL device without a display; tried: " + text);
    }
    return devices;
#else
    job.note("this build has no GPU backends (STX_WITH_GPU was off)");
    return {};
#endif
}

}  // namespace stx
