// Milliseconds of the median frame of each mode, on the processor or a GPU, frames drawn one after
// another, read back and not written, and points a second as a share of the yardsticks'
// (yardstick.hpp), which are timed in turn with them.
//
//     bench_spheres [--json] [--gpu] [--frames N] [BUNDLE CAMERAS [MODE...]]
//
// CAMERAS is a camera file, or orbit:N for N pictures of 512x512 around the object. Modes:
// normal, best (surface), splat, points; all without one. Without BUNDLE: MPEG's scene spheres-miv.

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <string>
#include <vector>

#include "formats/any/open.hpp"
#include "formats/imagesets/camera_file.hpp"
#include "formats/stx/stx.hpp"
#include "lib/render/factory.hpp"
#include "tests/bench/yardstick.hpp"

namespace {

using namespace stx;

struct Mode {
    const char* word;
    const char* name;
    RenderMode mode;
    Quality quality;
    SplatRule splat;
};
constexpr Mode kModes[] = {
    {"normal", "surface normal", RenderMode::surface, Quality::normal, SplatRule::data},
    {"best", "surface best", RenderMode::surface, Quality::best, SplatRule::data},
    {"splat", "splat", RenderMode::splat, Quality::normal, SplatRule::data},
    {"points", "points", RenderMode::splat, Quality::normal, SplatRule::point}};

struct Options {
    std::string input, cameras;
    std::vector<std::string> modes;
    int frames = 60;
    bool json = false;
    Backend backend = Backend::cpu;
};

Result<std::vector<Camera>> camerasOf(const Options& o, const Bundle& bundle, Job& job) {
    std::vector<Camera> novel;
    if (o.cameras.rfind("orbit:", 0) == 0) {
        const Bounds bounds = bundle.bounds ? *bundle.bounds : bundle.computeBounds();
        return orbitCameras(bounds.centre(), bounds.radius(), std::atoi(o.cameras.c_str() + 6), 0.3,
                            {});
    }
    STX_TRY(const auto named, readCameraFile(o.cameras, job));
    for (const auto& c : named)
        if (c.name.rfind("gt_", 0) == 0) novel.push_back(c.camera);
    if (novel.empty())
        for (const auto& c : named) novel.push_back(c.camera);
    return novel;
}

double median(std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

Result<void> measure(const Options& o) {
    Job job;
    STX_TRY(const auto bundle, openBundle(o.input, {}, job));
    STX_TRY(const auto novel, camerasOf(o, bundle, job));
    const auto points = static_cast<double>(bundle.pointCount());
    bench::Yardstick yardstick;
    for (const Mode& mode : kModes) {
        if (!o.modes.empty() &&
            std::find(o.modes.begin(), o.modes.end(), mode.word) == o.modes.end())
            continue;
        RenderSettings settings;
        settings.mode = mode.mode;
        settings.quality = mode.quality;
        settings.splat = mode.splat;
        STX_TRY(const auto renderer, makeRenderer(o.backend, bundle, settings, -1, job));
        std::vector<double> ours, plain, vectors;
        std::clock_t processor = 0;
        const int warm = std::max(1, o.frames / 10);
        for (int i = 0; i < o.frames + warm; ++i) {
            const auto start = std::chrono::steady_clock::now();
            const std::clock_t before = std::clock();
            STX_CHECK(renderer->render(novel[static_cast<std::size_t>(i) % novel.size()]));
            const std::chrono::duration<double, std::milli> time =
                std::chrono::steady_clock::now() - start;
            if (i < warm) continue;
            processor += std::clock() - before;
            ours.push_back(time.count());
            plain.push_back(yardstick.draw());
            vectors.push_back(yardstick.drawInVectors());
        }
        const double milliseconds = median(ours);
        const double speed = points / milliseconds / 1e3;
        const double reached = yardstick.points() / median(plain) / 1e6;
        const double inVectors = yardstick.points() / median(vectors) / 1e6;
        if (o.json)
            std::printf(
                "{\"mode\":\"%s\",\"milliseconds\":%.3f,\"processor\":%.3f,\"points\":%.0f,"
                "\"yardstick\":%.2f,\"vectors\":%.2f}\n",
                mode.word, milliseconds,
                1e3 * static_cast<double>(processor) / CLOCKS_PER_SEC / o.frames, points, reached,
                inVectors);
        else
            std::printf(
                "%-15s %7.1f ms %8.1f million points/s, %.2f of the yardstick's %.0f, %.3f "
                "of the %.0f in vectors on all threads\n",
                mode.name, milliseconds, speed, speed / reached, reached, speed / inVectors,
                inVectors);
        std::fflush(stdout);
    }
    return {};
}

}  // namespace

int main(int count, char** values) {
    Options o;
    std::vector<std::string> words;
    for (int i = 1; i < count; ++i) {
        const std::string word = values[i];
        if (word == "--json")
            o.json = true;
        else if (word == "--gpu")
            o.backend = Backend::gpu;
        else if (word == "--frames" && i + 1 < count)
            o.frames = std::max(1, std::atoi(values[++i]));
        else
            words.push_back(word);
    }
    if (words.size() >= 2) {
        o.input = words[0];
        o.cameras = words[1];
        o.modes.assign(words.begin() + 2, words.end());
    } else {
        const char* shared = std::getenv("STX_SHARED_DIR");
        const std::filesystem::path folder =
            std::filesystem::path(shared ? shared : STX_SHARED_DIR) / "data/imagesets/spheres-miv";
        if (!words.empty() || !std::filesystem::exists(folder)) {
            std::fprintf(stderr,
                         "'%s' is not here; usage: bench_spheres BUNDLE CAMERAS [MODE...]\n",
                         folder.c_str());
            return 2;
        }
        o.input = folder.string();
        o.cameras = (folder / "cameras.json").string();
    }
    if (const auto done = measure(o); !done) {
        std::fprintf(stderr, "%s\n", done.error().text().c_str());
        return static_cast<int>(done.error().code);
    }
    return 0;
}
