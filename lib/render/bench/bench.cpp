#include "lib/render/bench/bench.hpp"

#include "lib/base/cpu_device.hpp"
#include "lib/base/parallel.hpp"
#include "lib/render/bench/analytic_scene.hpp"
#include "lib/render/splat/cpu/cpu_splat.hpp"
#include "lib/render/surface/cpu/cpu_surface.hpp"
#ifdef STX_WITH_GPU
#include "lib/render/device/egl_context.hpp"
#include "lib/render/splat/gl/gl_renderer.hpp"
#include "lib/render/splat/gpu/gpu_splat.hpp"
#include "lib/render/surface/gpu/gpu_surface.hpp"
#endif

namespace stx {
namespace {

#ifdef STX_WITH_GPU
/// Surface mode takes a software driver so long that it is measured there only when asked for.
Result<void> checkHardware(int device) {
    std::vector<std::string> tried;
    const auto devices = gpu::enumerateDevices(tried);
    const auto at = static_cast<std::size_t>(std::max(device, 0));
    if (at < devices.size() && devices[at].software)
        return fail(ErrorCode::unsupported,
                    "'{}' is a software driver, which is slow at it; name the path to measure it",
                    devices[at].name);
    return {};
}
#endif

/// `named`: the path was asked for by name.
Result<std::unique_ptr<Renderer>> makePath(const std::string& path, bool named,
                                           const Bundle& bundle, SplatRule splat, int device,
                                           Job& job) {
    RenderSettings settings;
    settings.mode =
        path == "surface" || path == "surface-gpu" ? RenderMode::surface : RenderMode::splat;
    settings.splat = path == "points" ? SplatRule::point : splat;
    if (path == "surface") return makeCpuSurfaceRenderer(bundle, settings, job);
    if (path == "software" || path == "points") return makeCpuSplatRenderer(bundle, settings, job);
#ifdef STX_WITH_GPU
    if (path == "surface-gpu") {
        if (!named) STX_CHECK(checkHardware(device));
        return gpu::makeGpuSurfaceRenderer(bundle, settings, device, job);
    }
    if (path == "gl") return gl::makeGlRenderer(bundle, settings, device, job);
    settings.pipeline = path == "shader" ? GpuPipeline::raster : GpuPipeline::compute;
    return gpu::makeGpuSplatRenderer(bundle, settings, device, job);
#else
    (void)named;
    (void)device;
    return fail(ErrorCode::unsupported, "this build has no GPU backends");
#endif
}

std::string ruleOf(const std::string& path, SplatRule splat) {
    if (path == "surface" || path == "surface-gpu") return "";
    if (path == "points") return "point";
    return splat == SplatRule::paper ? "paper" : "data";
}

/// Milliseconds of the median frame.
Result<double> measure(Renderer& renderer, const Camera& camera, int repeats, Job& job) {
    std::vector<double> times;
    for (int i = 0; i <= repeats; ++i) {
        STX_CHECK(job.checkCancelled());
        STX_TRY(const Frame frame, renderer.render(camera));
        if (i > 0) times.push_back(frame.milliseconds);  // the first only warms up
    }
    std::nth_element(times.begin(), times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2),
                     times.end());
    return std::max(times[times.size() / 2], 1e-6);
}

}  // namespace

const std::vector<std::string>& benchPaths() {
    static const std::vector<std::string> paths{"shader", "gl",      "software",   "compute",
                                                "points", "surface", "surface-gpu"};
    return paths;
}

Result<BenchReport> runBench(const BenchSettings& settings, Job& job) {
    if (settings.repeats < 1 || settings.repeats > 1000)
        return fail(ErrorCode::usage, "{} repeats; 1 to 1000 are possible", settings.repeats);
    if (settings.splat == SplatRule::point)
        return fail(ErrorCode::usage, "points are a path of their own; splats are data or paper");
    for (const auto& path : settings.paths) {
        if (std::find(benchPaths().begin(), benchPaths().end(), path) == benchPaths().end())
            return fail(ErrorCode::usage, "no path is called '{}'; there are {}", path,
                        fmt::join(benchPaths(), ", "));
    }
    const auto& paths = settings.paths.empty() ? benchPaths() : settings.paths;
    struct Case {
        int table;
        AnalyticScene scene;
        int references;
    };
    std::vector<Case> cases;
    if (settings.table1)
        for (const int n : {4, 9, 16}) cases.push_back({1, AnalyticScene::object, n});
    if (settings.table2)
        for (const int n : {1, 4, 8}) cases.push_back({2, AnalyticScene::room, n});

    BenchReport report;
    report.processor = cpuDeviceName();
    report.threads = threadCount();
    const auto total = static_cast<std::int64_t>(cases.size() * paths.size());
    std::int64_t done = 0;
    for (const Case& one : cases) {
        const Bundle bundle = analyticBundle(one.scene, one.references);
        const std::int64_t points = bundle.pointCount();
        const Camera camera = analyticCamera(one.scene, 0.5, one.references);
        for (const auto& path : paths) {
            STX_CHECK(job.checkCancelled());
            job.progress(done++, total, path);
            auto renderer = makePath(path, !settings.paths.empty(), bundle, settings.splat,
                                     settings.device, job);
            if (!renderer) {
                // A wrong request is an error; what the machine lacks is a gap in the table.
                if (renderer.error().code == ErrorCode::usage) return propagate(renderer);
                job.note(fmt::format("path {} is left out: {}", path, renderer.error().text()));
                continue;
            }
            if ((*renderer)->backend() != "cpu") report.device = (*renderer)->device();
            STX_TRY(const double milliseconds, measure(**renderer, camera, settings.repeats, job));
            report.rows.push_back({one.table, one.references, points, path,
                                   ruleOf(path, settings.splat), 1000.0 / milliseconds,
                                   static_cast<double>(points) / milliseconds * 1e-3});
        }
    }
    job.progress(total, total, "done");
    return report;
}

}  // namespace stx
