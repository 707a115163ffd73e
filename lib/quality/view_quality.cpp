#include "lib/quality/view_quality.hpp"

#include <limits>

#include "lib/capture/capture.hpp"
#include "lib/geometry/view_layout.hpp"
#include "lib/metrics/compare.hpp"
#include "lib/render/api/frame_picture.hpp"
#include "lib/render/mesh/mesh_renderer.hpp"

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

Result<ViewQuality> ViewQuality::against(const Mesh& mesh, int side, Job& job) {
    return against(*makeMeshRenderer(mesh, {}, job), mesh, side, job);
}

Result<ViewQuality> ViewQuality::against(Renderer& truth, const Mesh& mesh, int side,
                                         const Job& job) {
    ViewFraming framing;
    framing.width = framing.height = side;
    ViewLayout layout;
    layout.count = 6;
    const auto points = drawnPoints(mesh);
    const auto sphere = boundingSphere(points);
    std::vector<Camera> cameras;
    for (const auto& direction : layoutDirections(layout)) {
        STX_TRY(const auto camera, frameCamera(direction, framing, points, sphere, false));
        cameras.push_back(camera);
    }
    return against(truth, std::move(cameras), job);
}

ViewQuality ViewQuality::of(std::span<const ReferenceView> views) {
    ViewQuality quality;
    for (const ReferenceView& view : views) {
        quality.cameras_.push_back(view.camera);
        Frame frame;
        frame.linear = view.texture.isLinear();
        frame.colour = Image<glm::vec4>(view.depth.width(), view.depth.height());
        for (std::size_t i = 0; i < frame.colour.count(); ++i) {
            const glm::vec4 c = view.texture.at(i);
            frame.colour.data()[i] = glm::vec4(glm::vec3(c) * c.a, c.a);
        }
        quality.truth_.push_back(rgba8From(frame, glm::vec3(0.0f)));
    }
    return quality;
}

Result<ViewQuality::Psnr> ViewQuality::measure(Renderer& renderer, const Job& job) const {
    SequenceComparison all;
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
