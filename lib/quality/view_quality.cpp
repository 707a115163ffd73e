#include "lib/quality/view_quality.hpp"

#include <limits>

#include "lib/metrics/compare.hpp"
#include "lib/render/api/frame_picture.hpp"

namespace stx {
namespace {

constexpr double kIdentical = std::numeric_limits<double>::infinity();

Result<Rgba8Image> drawn(Renderer& renderer, const Camera& camera, const Job& job) {
    STX_CHECK(job.checkCancelled());
    STX_TRY(const auto frame, renderer.render(camera));
    return rgba8From(frame, glm::vec3(0.0f));
}

}  // namespace

Result<ViewQuality> ViewQuality::against(Renderer& truth, std::vector<Camera> cameras,
                                         const Job& job) {
    ViewQuality quality;
    quality.cameras_ = std::move(cameras);
    for (const Camera& camera : quality.cameras_) {
        STX_TRY(auto picture, drawn(truth, camera, job));
        quality.truth_.push_back(std::move(picture));
    }
    return quality;
}

Result<ViewQuality::Psnr> ViewQuality::measure(Renderer& renderer, const Job& job) const {
    SequenceComparison all(255.0);
    Psnr psnr{kIdentical, kIdentical};
    for (std::size_t i = 0; i < cameras_.size(); ++i) {
        STX_TRY(const auto picture, drawn(renderer, cameras_[i], job));
        STX_TRY(const auto one, compare(picture, truth_[i]));
        all.add(one);
        psnr.worst = std::min(psnr.worst, one.psnrRgb.value_or(kIdentical));
    }
    psnr.all = all.total().psnrRgb.value_or(kIdentical);
    return psnr;
}

}  // namespace stx
