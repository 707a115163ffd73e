#include "lib/quality/capture_quality.hpp"

#include "lib/geometry/view_layout.hpp"
#include "lib/quality/view_quality.hpp"
#include "lib/render/mesh/mesh_renderer.hpp"
#include "lib/selection/selection.hpp"

namespace stx {

Result<int> fewestCameras(const Mesh& mesh, const std::vector<Camera>& cameras,
                          const CaptureSettings& settings, double wantedPsnr, Job& job) {
    constexpr int kNovelViews = 6, kSide = 256;
    Job quiet;  // each attempt would give the same notes again
    quiet.limits = job.limits;
    ViewFraming framing;
    framing.width = framing.height = kSide;
    ViewLayout layout;
    layout.count = kNovelViews;
    STX_TRY(auto novel, layoutCameras(layout, framing, drawnPoints(mesh)));
    STX_TRY(const auto quality,
            ViewQuality::against(*makeMeshRenderer(mesh, {}, quiet), std::move(novel), job));
    return leastViews(static_cast<int>(cameras.size()), wantedPsnr, [&](int n) -> Result<double> {
        STX_TRY(const auto bundle,
                captureBundle(mesh, {cameras.begin(), cameras.begin() + n}, settings, quiet));
        STX_TRY(const auto renderer, makeRenderer(Backend::cpu, bundle, {}, -1, quiet));
        STX_TRY(const auto psnr, quality.measure(*renderer, job));
        return psnr.all;
    });
}

}  // namespace stx
