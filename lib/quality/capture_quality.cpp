#include "lib/quality/capture_quality.hpp"

#include <algorithm>
#include <map>

#include "lib/capture/rasterizer.hpp"
#include "lib/model/translucent.hpp"
#include "lib/quality/view_quality.hpp"
#include "lib/render/factory.hpp"
#include "lib/selection/selection.hpp"

namespace stx {
namespace {

/// Draws a mesh as the best of views would show it in surface mode: translucent surfaces are opaque
/// in the colour that a view has there, and what is kept beside the colour is not in it. What no
/// number of views brings nearer must not decide how many there are.
class ShownByViews : public Renderer {
  public:
    ShownByViews(const Mesh& mesh, const CaptureSettings& settings, Job& job)
        : mesh_(mesh), materials_(settings.materials), job_(job) {}

    Result<Frame> render(const Camera& camera) override {
        RasterSettings raster;
        raster.materials = materials_;
        STX_TRY(auto image, rasterise(mesh_, camera, raster, job_));
        image.code();
        // Views clip what is brighter than white before anything is behind it.
        if (mesh_.splats)
            for (auto& c : image.colour.pixels()) c = glm::vec4(glm::min(glm::vec3(c), c.w), c.w);
        const Texture texture(std::move(image.colour));
        const auto solid = translucentSurfaces(texture, image.depth);
        Frame frame;
        frame.colour = *texture.rgbaFloat();
        for (std::size_t i = 0; i < solid.count(); ++i) {
            glm::vec4& c = frame.colour.data()[i];
            if (solid.data()[i] && c.a > 0) c = glm::vec4(glm::vec3(c) / c.a, 1.0f);
        }
        frame.depth = std::move(image.depth);
        return frame;
    }
    [[nodiscard]] std::string backend() const override { return "cpu"; }
    [[nodiscard]] std::string device() const override { return "rasteriser"; }

  private:
    const Mesh& mesh_;
    bool materials_;
    Job& job_;
};

}  // namespace

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
    ShownByViews truth(mesh, settings, quiet);
    STX_TRY(const auto quality, ViewQuality::against(truth, mesh, side, quiet));
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
