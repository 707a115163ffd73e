// The figures of spheres-miv in README.md here: milliseconds of the median frame of each mode on
// the processor, frames drawn one after another and not written. Usage: bench_spheres [bundle.exr
// cameras.json]

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "formats/imagesets/camera_file.hpp"
#include "formats/open.hpp"
#include "lib/render/renderer.hpp"

namespace {

using namespace stx;

struct Mode {
    const char* name;
    RenderMode mode;
    Quality quality;
    SplatRule splat;
};

constexpr int kFrames = 60, kWarm = 6;

int run(const std::string& input, const std::string& cameraFile) {
    Job job;
    const auto bundle = openBundle(input, {}, job);
    const auto cameras = readCameraFile(cameraFile, job);
    if (!bundle || !cameras) {
        std::fprintf(stderr, "%s\n",
                     (bundle ? cameras.error().text() : bundle.error().text()).c_str());
        return 2;
    }
    std::vector<Camera> novel;
    for (const auto& c : *cameras)
        if (c.name.rfind("gt_", 0) == 0) novel.push_back(c.camera);
    if (novel.empty())
        for (const auto& c : *cameras) novel.push_back(c.camera);
    for (const Mode& mode :
         {Mode{"surface draft", RenderMode::surface, Quality::draft, SplatRule::data},
          Mode{"surface normal", RenderMode::surface, Quality::normal, SplatRule::data},
          Mode{"surface best", RenderMode::surface, Quality::best, SplatRule::data},
          Mode{"splat", RenderMode::splat, Quality::normal, SplatRule::data},
          Mode{"points", RenderMode::splat, Quality::normal, SplatRule::point}}) {
        RenderSettings settings;
        settings.mode = mode.mode;
        settings.quality = mode.quality;
        settings.splat = mode.splat;
        const auto renderer = makeRenderer(Backend::cpu, *bundle, settings, -1, job);
        if (!renderer) {
            std::fprintf(stderr, "%s\n", renderer.error().text().c_str());
            return 4;
        }
        std::vector<double> times;
        for (int i = 0; i < kFrames; ++i) {
            const auto start = std::chrono::steady_clock::now();
            const auto frame =
                (*renderer)->render(novel[static_cast<std::size_t>(i) % novel.size()]);
            if (!frame) return 4;
            if (i < kWarm) continue;
            times.push_back(
                std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
                    .count());
        }
        std::nth_element(times.begin(), times.begin() + static_cast<int>(times.size() / 2),
                         times.end());
        const double median = times[times.size() / 2];
        std::printf("%-15s %7.1f ms %8.1f million points/s\n", mode.name, median,
                    static_cast<double>(bundle->pointCount()) / median / 1e3);
    }
    return 0;
}

}  // namespace

int main(int count, char** values) {
    if (count == 3) return run(values[1], values[2]);
    const char* shared = std::getenv("STX_SHARED_DIR");
    const std::filesystem::path folder =
        std::filesystem::path(shared ? shared : STX_SHARED_DIR) / "data/imagesets/spheres-miv";
    if (!std::filesystem::exists(folder)) {
        std::fprintf(stderr, "'%s' is not here; usage: bench_spheres bundle.exr cameras.json\n",
                     folder.c_str());
        return 2;
    }
    return run(folder.string(), (folder / "cameras.json").string());
}
