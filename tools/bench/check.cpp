#include "tools/bench/check.hpp"

#include <algorithm>
#include <map>
#include <vector>

#include "lib/base/stopwatch.hpp"
#include "lib/metrics/compare.hpp"
#include "lib/render/api/frame_picture.hpp"
#include "lib/render/bench/analytic_scene.hpp"
#include "lib/render/factory.hpp"
#include "lib/surface/normals.hpp"

namespace stx {
namespace {

/// The conventional path draws squares of whole pixels and blends nothing, so that no number of the
/// others is its measure. What it may be off by is known beforehand: a pixel. Its limit is what the
/// processor's own picture has when it is moved by one pixel (movedDb()).
constexpr double kByOnePixel = -1.0;

/// One way to draw.
struct Way {
    const char* name;
    Backend backend;
    RenderMode mode;
    Quality quality;
    SplatRule splat;
    GpuPipeline pipeline;
    bool lit;
    double leastDb = kAlikeDb;
};

constexpr auto kNormal = Quality::normal;
constexpr auto kByDevice = GpuPipeline::automatic;

constexpr Way kWays[] = {
    {"surface, normal", Backend::gpu, RenderMode::surface, kNormal, SplatRule::data, kByDevice,
     false},
    {"surface, best", Backend::gpu, RenderMode::surface, Quality::best, SplatRule::data, kByDevice,
     false},
    {"surface, normal, lit", Backend::gpu, RenderMode::surface, kNormal, SplatRule::data, kByDevice,
     true},
    {"splat data, compute", Backend::gpu, RenderMode::splat, kNormal, SplatRule::data,
     GpuPipeline::compute, false},
    {"splat paper, compute", Backend::gpu, RenderMode::splat, kNormal, SplatRule::paper,
     GpuPipeline::compute, false},
    {"splat point, compute", Backend::gpu, RenderMode::splat, kNormal, SplatRule::point,
     GpuPipeline::compute, false},
    {"splat data, compute, lit", Backend::gpu, RenderMode::splat, kNormal, SplatRule::data,
     GpuPipeline::compute, true},
    {"splat data, raster", Backend::gpu, RenderMode::splat, kNormal, SplatRule::data,
     GpuPipeline::raster, false},
    {"splat paper, raster", Backend::gpu, RenderMode::splat, kNormal, SplatRule::paper,
     GpuPipeline::raster, false},
    {"splat point, raster", Backend::gpu, RenderMode::splat, kNormal, SplatRule::point,
     GpuPipeline::raster, false},
    {"splat data, raster, lit", Backend::gpu, RenderMode::splat, kNormal, SplatRule::data,
     GpuPipeline::raster, true},
    {"splat paper, conventional GL", Backend::gl, RenderMode::splat, kNormal, SplatRule::paper,
     kByDevice, false, kByOnePixel},
};

RenderSettings settingsOf(const Way& way) {
    RenderSettings s;
    s.mode = way.mode;
    s.quality = way.quality;
    s.splat = way.splat;
    s.pipeline = way.pipeline;
    if (way.lit) {
        Light light;
        light.kind = Light::Kind::directional;
        light.vector = {-0.5f, -1.0f, -0.6f};
        s.lighting.lights.push_back(light);
    }
    return s;
}

/// Of the pictures: small, so that devices of software have done in a minute or two.
constexpr int kWidth = 256;

struct Drawn {
    Rgba8Image picture;
    double milliseconds = 0;  ///< of the second frame: the first warms caches up
};

Result<Drawn> draw(Backend backend, const Bundle& bundle, const Camera& camera, const Way& way,
                   int device, Job& job) {
    STX_TRY(const auto renderer, makeRenderer(backend, bundle, settingsOf(way), device, job));
    STX_TRY(auto frame, renderer->render(camera));
    const Stopwatch watch;
    STX_TRY(frame, renderer->render(camera));
    Drawn drawn;
    drawn.milliseconds = watch.milliseconds();
    drawn.picture = rgba8From(frame);
    return drawn;
}

/// PSNR of a picture against itself, one pixel further right and down.
Result<double> movedDb(const Rgba8Image& picture) {
    Rgba8Image moved(picture.width(), picture.height());
    for (int y = 0; y < picture.height(); ++y) {
        for (int x = 0; x < picture.width(); ++x)
            moved.at(x, y) = picture.at(std::max(x - 1, 0), std::max(y - 1, 0));
    }
    STX_TRY(const auto found, compare(moved, picture));
    return found.psnrRgb.value_or(kAlikeDb);
}

struct CheckScene {
    const char* name;
    Bundle bundle;
    Camera camera;
};

}  // namespace

Result<GpuCheckReport> checkGpus(const GpuCheckSettings& settings, Job& job) {
    std::vector<Device> devices = listDevices(job);
    if (settings.device >= 0)
        std::erase_if(devices, [&](const Device& d) { return d.index != settings.device; });
    if (devices.empty()) {
        const auto tried = job.takeNotes();
        return fail(ErrorCode::unsupported, "no OpenGL device answers: {}",
                    tried.empty() ? "none is listed" : fmt::format("{}", fmt::join(tried, "; ")));
    }
    std::vector<CheckScene> scenes;
    for (const auto& [kind, name, views, index] :
         {std::tuple{AnalyticScene::object, "object", 9, 0.5},
          std::tuple{AnalyticScene::room, "room", 2, 0.5}}) {
        const Camera camera = analyticCamera(kind, index, views);
        scenes.push_back({name, analyticBundle(kind, views),
                          camera.resized(kWidth, kWidth * camera.height / camera.width)});
        // Light needs normals; splats get their axes.
        STX_CHECK(bake(scenes.back().bundle, {}, job));
    }
    GpuCheckReport report;
    // The processor's pictures are the same for every device.
    std::map<std::pair<const Way*, const CheckScene*>, Drawn> truths;
    for (const Device& device : devices) {
        settings.print(fmt::format(
            "device {}: {}, OpenGL {}, {}\n{:<30}{:<8}{:>10}{:>8}{:>8}{:>10}{:>10}\n", device.index,
            device.name, device.version, device.software ? "software" : "hardware", "", "scene",
            "dB", "limit", "worst", "ms", "cpu ms"));
        for (const Way& way : kWays) {
            for (const CheckScene& scene : scenes) {
                STX_CHECK(job.checkCancelled());
                settings.print(fmt::format("{:<30}{:<8}", way.name, scene.name));
                auto drawn = draw(way.backend, scene.bundle, scene.camera, way, device.index, job);
                if (!drawn) {
                    ++report.refused;
                    settings.print("  not here: " + drawn.error().message + "\n");
                    continue;
                }
                auto& truth = truths[{&way, &scene}];
                if (truth.picture.empty())
                    STX_SET(truth, draw(Backend::cpu, scene.bundle, scene.camera, way, -1, job));
                STX_TRY(const auto found, compare(drawn->picture, truth.picture));
                ++report.drawn;
                double least = way.leastDb;
                if (least == kByOnePixel) STX_SET(least, movedDb(truth.picture));
                const bool alike = found.identical() || *found.psnrRgb >= least;
                report.wrong += alike ? 0 : 1;
                settings.print(
                    fmt::format("{:>10}{:>8.1f}{:>8.0f}{:>10.2f}{:>10.2f}{}\n",
                                found.identical() ? "same" : fmt::format("{:.1f}", *found.psnrRgb),
                                least, found.worst.difference, drawn->milliseconds,
                                truth.milliseconds, alike ? "" : "  UNLIKE THE PROCESSOR'S"));
            }
        }
    }
    return report;
}

}  // namespace stx
