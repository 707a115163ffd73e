// How fast the processor's renderers are, as ratios to the yardstick, which is timed in the same
// run, frame by frame in turn with them, so that a busy machine slows both. Lee & Park's full-frame
// case: 1024x768 views in which every pixel is a point.

#include <algorithm>
#include <chrono>
#include <ctime>

#include <benchmark/benchmark.h>

#include "lib/base/parallel.hpp"
#include "lib/render/bench/analytic_scene.hpp"
#include "lib/render/factory.hpp"
#include "tests/bench/yardstick.hpp"

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
    bench::Yardstick plain;
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
        best(theirs, costOf([&] { plain.draw(); }));
    }
    const auto points = static_cast<double>(bundle.pointCount());
    state.SetLabel((*renderer)->device());
    state.counters["Mpts/s"] = points / ours.wall / 1e3;
    state.counters["yardstick Mpts/s"] = points / theirs.wall / 1e3;
    // Processor time of a point, and how often the yardstick's: below 1 is cheaper.
    state.counters["ns/pt"] = ours.processor * 1e6 / points;
    state.counters["yardstick ns/pt"] = theirs.processor * 1e6 / points;
    state.counters["times yardstick"] = ours.processor / theirs.processor;
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
