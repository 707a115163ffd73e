// How fast the processor's renderers are, as ratios to a plain z-buffered splat of one pixel that
// is timed in the same run, frame by frame in turn with them, so that a busy machine slows both.
// Lee & Park's full-frame case: 1024x768 views in which every pixel is a point.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <ctime>
#include <vector>

#include <benchmark/benchmark.h>

#include "lib/base/parallel.hpp"
#include "lib/render/bench/analytic_scene.hpp"
#include "lib/render/renderer.hpp"

namespace {

using namespace stx;

constexpr int kReferences = 4;

const Bundle& roomBundle() {
    static const Bundle bundle = analyticBundle(AnalyticScene::room, kReferences);
    return bundle;
}

Camera novelCamera() {
    return analyticCamera(AnalyticScene::room, 1.5, kReferences);
}

// What anybody would write first: every point transformed and put into a z-buffer, in floats, the
// points of each reference shared out among threads by rows with a buffer for each thread.
class PlainSplat {
  public:
    explicit PlainSplat(const Bundle& bundle) : bundle_(bundle) {}

    void render(const Camera& novel) {
        const int threads = threadCount();
        const std::size_t pixels = static_cast<std::size_t>(novel.width) * novel.height;
        buffers_.resize(threads);
        parallelFor(0, threads, [&](std::int64_t t) {
            auto& buffer = buffers_[t];
            buffer.assign(pixels, ~std::uint64_t{0});
            for (const auto& v : bundle_.views) {
                const int from = static_cast<int>(v.camera.height * t / threads);
                const int to = static_cast<int>(v.camera.height * (t + 1) / threads);
                splat(v, novel, from, to, buffer);
            }
        });
        picture_.resize(pixels);
        parallelForBlocks(0, static_cast<std::int64_t>(pixels), 1 << 14,
                          [&](std::int64_t from, std::int64_t to) {
                              for (auto i = from; i < to; ++i) {
                                  std::uint64_t nearest = buffers_[0][i];
                                  for (int t = 1; t < threads; ++t)
                                      nearest = std::min(nearest, buffers_[t][i]);
                                  picture_[i] = static_cast<std::uint32_t>(nearest);
                              }
                          });
        benchmark::DoNotOptimize(picture_.data());
    }

  private:
    static void splat(const ReferenceView& v, const Camera& novel, int from, int to,
                      std::vector<std::uint64_t>& buffer) {
        const glm::mat4 m(novel.cameraFromWorld() * v.camera.worldFromCamera());
        const auto fx = static_cast<float>(novel.fx), fy = static_cast<float>(novel.fy);
        const auto cx = static_cast<float>(novel.cx), cy = static_cast<float>(novel.cy);
        const auto* colours = v.texture.rgba8()->data();
        for (int y = from; y < to; ++y) {
            for (int x = 0; x < v.camera.width; ++x) {
                const float z = v.depth.at(x, y);
                if (!hasPoint(z)) continue;
                const float px = (x + 0.5f - static_cast<float>(v.camera.cx)) /
                                 static_cast<float>(v.camera.fx) * z;
                const float py = -(y + 0.5f - static_cast<float>(v.camera.cy)) /
                                 static_cast<float>(v.camera.fy) * z;
                const float qx = m[0][0] * px + m[1][0] * py - m[2][0] * z + m[3][0];
                const float qy = m[0][1] * px + m[1][1] * py - m[2][1] * z + m[3][1];
                const float depth = -(m[0][2] * px + m[1][2] * py - m[2][2] * z + m[3][2]);
                if (!(depth > 0)) continue;
                const int i = static_cast<int>(std::floor(cx + fx * qx / depth));
                const int j = static_cast<int>(std::floor(cy - fy * qy / depth));
                if (i < 0 || j < 0 || i >= novel.width || j >= novel.height) continue;
                std::uint32_t bits, colour;
                std::memcpy(&bits, &depth, 4);
                std::memcpy(&colour, &colours[static_cast<std::size_t>(y) * v.camera.width + x], 4);
                auto& at = buffer[static_cast<std::size_t>(j) * novel.width + i];
                at = std::min(at, (std::uint64_t{bits} << 32) | colour);
            }
        }
    }

    const Bundle& bundle_;
    std::vector<std::vector<std::uint64_t>> buffers_;
    std::vector<std::uint32_t> picture_;
};

struct Cost {
    double wall = 0;  // milliseconds
    double processor =
        0;  // milliseconds of all threads together: what a busy machine distorts less
};

Cost costOf(const auto& work) {
    const auto start = std::chrono::steady_clock::now();
    const std::clock_t clock = std::clock();
    work();
    return {
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count(),
        1e3 * static_cast<double>(std::clock() - clock) / CLOCKS_PER_SEC};
}

void renderFrames(benchmark::State& state, const RenderSettings& settings) {
    const ThreadLimit limit(static_cast<int>(state.range(0)));
    const Bundle& bundle = roomBundle();
    const Camera camera = novelCamera();
    Job job;
    auto renderer = makeRenderer(Backend::cpu, bundle, settings, -1, job);
    if (!renderer) {
        state.SkipWithError(renderer.error().text().c_str());
        return;
    }
    PlainSplat plain(bundle);
    Cost ours{1e300, 1e300}, theirs = ours;
    const auto best = [](Cost& so, Cost now) {
        so.wall = std::min(so.wall, now.wall);
        so.processor = std::min(so.processor, now.processor);
    };
    for (auto _ : state) {
        const Cost cost = costOf([&] {
            auto frame = (*renderer)->render(camera);
            benchmark::DoNotOptimize(frame->colour.data());
        });
        state.SetIterationTime(cost.wall / 1000);
        best(ours, cost);
        best(theirs, costOf([&] { plain.render(camera); }));
    }
    const auto points = static_cast<double>(bundle.pointCount());
    state.SetLabel((*renderer)->device());
    state.counters["Mpts/s"] = points / ours.wall / 1e3;
    state.counters["plain Mpts/s"] = points / theirs.wall / 1e3;
    // Processor time of a point, and how often the plain loop's: below 1 is cheaper.
    state.counters["ns/pt"] = ours.processor * 1e6 / points;
    state.counters["plain ns/pt"] = theirs.processor * 1e6 / points;
    state.counters["times plain"] = ours.processor / theirs.processor;
}

void splatFrames(benchmark::State& state, SplatRule rule) {
    RenderSettings settings;
    settings.mode = RenderMode::splat;
    settings.splat = rule;
    renderFrames(state, settings);
}

void surfaceFrames(benchmark::State& state, Quality quality) {
    RenderSettings settings;
    settings.mode = RenderMode::surface;
    settings.quality = quality;
    renderFrames(state, settings);
}

BENCHMARK_CAPTURE(splatFrames, data, SplatRule::data)
    ->Arg(1)
    ->Arg(2)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(splatFrames, point, SplatRule::point)
    ->Arg(1)
    ->Arg(2)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(splatFrames, paper, SplatRule::paper)
    ->Arg(2)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(surfaceFrames, draft, Quality::draft)
    ->Arg(2)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(surfaceFrames, normal, Quality::normal)
    ->Arg(2)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(surfaceFrames, best, Quality::best)
    ->Arg(2)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
