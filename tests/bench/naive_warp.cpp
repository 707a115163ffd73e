// What quality_table.py prints beside our pictures: the naive warp of the best single view, see
// tests/naive_warp.hpp. For each novel camera every view is warped, and the one that comes nearest
// to the truth counts. Prints JSON: for each camera the view, the PSNR over the whole frame (black
// where nothing came to lie) and over the pixels that it covers, of RGB and of Y, and their share.
//   naive_warp BUNDLE TRUTH_%d.png COVERED_%d.png CAMERAS
// CAMERAS is a file, or orbit:N:ELEVATION:SIDE, or eye:X,Y,Z:FOV:SIDE, looking at 0,0,0. The mask
// of what is covered is written for each camera. Frames count from 0.

#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "formats/any/open.hpp"
#include "formats/files/files.hpp"
#include "formats/images/images.hpp"
#include "formats/imagesets/camera_file.hpp"
#include "formats/stx/stx.hpp"
#include "tests/naive_warp.hpp"

namespace {

using namespace stx;

Result<std::vector<Camera>> camerasOf(const std::string& text, const Bundle& bundle, Job& job) {
    CameraSettings lens;
    int count = 0, side = 0;
    double elevation = 0, fov = 0;
    glm::dvec3 eye(0.0);
    if (std::sscanf(text.c_str(), "orbit:%d:%lf:%d", &count, &elevation, &side) == 3) {
        lens.width = lens.height = side;
        const Bounds bounds = boundsOf(Model(bundle));
        return orbitCameras(bounds.centre(), bounds.radius(), count, glm::radians(elevation), lens);
    }
    if (std::sscanf(text.c_str(), "eye:%lf,%lf,%lf:%lf:%d", &eye.x, &eye.y, &eye.z, &fov, &side) ==
        5) {
        lens.width = lens.height = side;
        lens.fovRad = glm::radians(fov);
        STX_TRY(const auto camera, cameraAt(eye - bundle.origin, -bundle.origin, lens));
        return std::vector<Camera>{camera};
    }
    STX_TRY(const auto named, readCameraFile(text, job));
    std::vector<Camera> cameras;
    for (const NamedCamera& c : named) {
        cameras.push_back(c.camera);
        cameras.back().position -= bundle.origin;
    }
    return cameras;
}

std::string frameName(const std::string& pattern, std::size_t number) {
    std::string name = pattern;
    const auto at = name.find("%d");
    return at == std::string::npos ? name : name.replace(at, 2, std::to_string(number));
}

/// Identical pictures count as 99 dB.
double decibels(const std::optional<double>& psnr) {
    return psnr.value_or(99.0);
}

Result<void> run(const char* const* arguments) {
    Job job;
    STX_TRY(const Bundle bundle, openBundle(arguments[0], {}, job));
    for (const ReferenceView& view : bundle.views)
        if (!view.texture.rgba8())
            return fail(ErrorCode::unsupported, "'{}': its views are not of 8 bits", arguments[0]);
    STX_TRY(const auto cameras, camerasOf(arguments[3], bundle, job));
    std::printf("{\"frames\":[");
    for (std::size_t c = 0; c < cameras.size(); ++c) {
        STX_TRY(const Picture truth, openPicture(frameName(arguments[1], c), job));
        std::size_t best = 0;
        std::optional<Comparison> whole;
        NaiveWarp chosen;
        for (std::size_t i = 0; i < bundle.views.size(); ++i) {
            NaiveWarp warped = naiveWarp(bundle.views[i], cameras[c]);
            STX_TRY(const auto compared, compare(warped.picture, truth.coded, CompareSettings{}));
            if (whole && decibels(compared.psnrRgb) <= decibels(whole->psnrRgb)) continue;
            best = i;
            whole = compared;
            chosen = std::move(warped);
        }
        std::int64_t points = 0;
        for (const std::uint8_t value : chosen.covered.pixels()) points += value != 0;
        Comparison covered;
        if (points > 0) {
            CompareSettings settings;
            settings.mask = &chosen.covered;
            STX_TRY(covered, compare(chosen.picture, truth.coded, settings));
        }
        std::printf(
            "%s{\"view\":%zu,\"whole\":{\"rgb\":%.3f,\"y\":%.3f},"
            "\"covered\":{\"rgb\":%.3f,\"y\":%.3f},\"share\":%.4f}",
            c ? "," : "", best, decibels(whole->psnrRgb), decibels(whole->psnrY),
            decibels(covered.psnrRgb), decibels(covered.psnrY),
            static_cast<double>(points) / static_cast<double>(chosen.covered.count()));
        STX_TRY(const Bytes png, encodePng(chosen.covered.width(), chosen.covered.height(), 1, 8,
                                           chosen.covered.data(), false, 1));
        STX_CHECK(writeFile(frameName(arguments[2], c), png));
    }
    std::printf("]}\n");
    return {};
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 5) {
        std::fprintf(stderr, "usage: naive_warp BUNDLE TRUTH_%%d.png COVERED_%%d.png CAMERAS\n");
        return 1;
    }
    const auto done = run(argv + 1);
    std::fflush(stdout);
    if (!done) std::fprintf(stderr, "%s\n", done.error().text().c_str());
    std::_Exit(done ? 0 : 4);
}
