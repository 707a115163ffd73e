#include "lib/quality/capture_quality.hpp"

#include <algorithm>
#include <map>

#include "lib/quality/view_quality.hpp"
#include "lib/render/factory.hpp"
#include "lib/selection/selection.hpp"

namespace stx {

Result<FewestCameras> fewestCameras(const Mesh& mesh, const std::vector<Camera>& cameras,
                                    const CaptureSettings& settings, double wantedPsnr, Job& job) {
    if (cameras.empty())
        return fail(ErrorCode::usage,
                    "no camera was given; at least one is expected to choose from");
    constexpr int kLargestSide = 512;
    constexpr double kAsGood = 0.1;  // dB that are not worth more views
    Job quiet;                       // each attempt would give the same notes again
    quiet.limits = job.limits;
    const int side = std::min(kLargestSide, std::max(cameras[0].width, cameras[0].height));
    STX_TRY(const auto quality, ViewQuality::against(mesh, side, quiet));
    std::map<int, double> reached;
    const auto measure = [&](int n) -> Result<double> {
        STX_TRY(const auto bundle,
                captureBundle(mesh, {cameras.begin(), cameras.begin() + n}, settings, quiet));
        STX_TRY(const auto renderer, makeRenderer(Backend::cpu, bundle, {}, -1, quiet));
        STX_TRY(const auto psnr, quality.measure(*renderer, job));
        reached[n] = psnr.all;
        return psnr.all;
    };
    STX_TRY(const int count, leastViews(static_cast<int>(cameras.size()), wantedPsnr, measure));
    if (reached[count] >= wantedPsnr) return FewestCameras{count, reached[count]};
    double best = 0;
    for (const auto& [n, psnr] : reached) best = std::max(best, psnr);
    for (const auto& [n, psnr] : reached)
        if (psnr >= best - kAsGood) return FewestCameras{n, psnr};
    return FewestCameras{count, reached[count]};
}

}  // namespace stx
