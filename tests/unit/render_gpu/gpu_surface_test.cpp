#include "lib/render/surface/gpu/gpu_surface.hpp"

#include "lib/render/surface/cpu/cpu_surface.hpp"
#include "lib/render/surface/gpu/surface_textures.hpp"
#include "tests/unit/render_gpu/gpu_fixture.hpp"

namespace stx {
namespace {

using test::coverageDifference;
using test::psnr;

const std::array<std::pair<Quality, const char*>, 2> kQualities{
    {{Quality::normal, "normal"}, {Quality::best, "best"}}};

RenderSettings surfaceSettings(Quality quality = Quality::normal) {
    RenderSettings s;
    s.mode = RenderMode::surface;
    s.quality = quality;
    return s;
}

class GpuSurface : public testing::Test {
  protected:
    void SetUp() override { REQUIRE_GPU(); }

    static Result<Frame> draw(const Bundle& bundle, const RenderSettings& settings,
                              const Camera& camera) {
        Job job;
        STX_TRY(auto renderer, gpu::makeGpuSurfaceRenderer(bundle, settings, -1, job));
        return renderer->render(camera);
    }
    /// Not through makeRenderer(), which takes no 10-bit depth.
    static Frame drawOnCpu(const Bundle& bundle, const RenderSettings& settings,
                           const Camera& camera) {
        Job job;
        auto frame = makeCpuSurfaceRenderer(bundle, settings, job)->render(camera);
        EXPECT_TRUE(frame) << (frame ? "" : frame.error().text());
        return frame ? std::move(*frame) : Frame{};
    }
    /// Draws with both and holds one against the other.
    static void agree(const Bundle& bundle, const RenderSettings& settings, const Camera& camera,
                      const std::string& what) {
        test::expectAgreement(draw(bundle, settings, camera), drawOnCpu(bundle, settings, camera),
                              what);
    }
};

TEST_F(GpuSurface, AgreesWithTheCpuOnTheObject) {
    const Bundle bundle = analyticBundle(AnalyticScene::object, 8, 2);
    for (const auto& [quality, name] : kQualities)
        agree(bundle, surfaceSettings(quality),
              test::small(analyticCamera(AnalyticScene::object, 0.4, 8), 160),
              fmt::format("object_{}", name));
}

TEST_F(GpuSurface, AgreesWithTheCpuInTheRoom) {
    const Bundle bundle = test::smallRoom(3);
    for (const auto& [quality, name] : kQualities)
        agree(bundle, surfaceSettings(quality),
              test::small(analyticCamera(AnalyticScene::room, 0.6, 3), 160),
              fmt::format("room_{}", name));
}

TEST_F(GpuSurface, AgreesWithTheCpuOnCodedDepth) {
    Bundle bundle = test::smallRoom(3, 192);
    for (auto& view : bundle.views) {
        view.depthBits = 10;
        for (float& d : view.depth.pixels())
            if (hasPoint(d))
                d = static_cast<float>(view.depthCode().decode(view.depthCode().encode(d)));
    }
    agree(bundle, surfaceSettings(), test::small(analyticCamera(AnalyticScene::room, 1.4, 3), 192),
          "coded");
}

TEST_F(GpuSurface, GivesAReferencesOwnPoseBackExactly) {
    const Bundle bundle = analyticBundle(AnalyticScene::object, 3, 2);
    const auto frame = draw(bundle, surfaceSettings(), bundle.views[1].camera);
    ASSERT_TRUE(frame) << frame.error().text();
    EXPECT_EQ(psnr(frame->colour, test::pictureOf(bundle.views[1])),
              std::numeric_limits<double>::infinity());
}

TEST_F(GpuSurface, DrawsFramesOfManyBatches) {
    // 4x4 samples of every pixel of a large frame are more than a batch holds.
    const Bundle bundle = test::smallRoom(1, 96);
    const Camera camera = bundle.views[0].camera.resized(1300, 330);
    const auto frame = draw(bundle, surfaceSettings(Quality::best), camera);
    ASSERT_TRUE(frame) << frame.error().text();
    EXPECT_GT(psnr(frame->colour, drawOnCpu(bundle, surfaceSettings(Quality::best), camera).colour),
              45.0);
}

}  // namespace
}  // namespace stx
