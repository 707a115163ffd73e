#include "lib/render/gpu/gpu_surface.hpp"

#include <thread>

#include "lib/render/cpu/cpu_surface.hpp"
#include "lib/render/gpu/gpu_surface_scene.hpp"
#include "tests/unit/gpu/gpu_fixture.hpp"

namespace stx {
namespace {

using test::coverageDifference;
using test::psnr;

const std::array<std::pair<Quality, const char*>, 3> kQualities{
    {{Quality::draft, "draft"}, {Quality::normal, "normal"}, {Quality::best, "best"}}};

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
        const auto frame = draw(bundle, settings, camera);
        ASSERT_TRUE(frame) << frame.error().text();
        const Frame expected = drawOnCpu(bundle, settings, camera);
        const double agreement = psnr(frame->colour, expected.colour);
        RecordProperty(what, fmt::format("{:.1f} dB", agreement));
        EXPECT_GT(agreement, 45.0) << what;
        const int differences = coverageDifference(frame->depth, expected.depth);
        EXPECT_LE(differences, static_cast<int>(frame->depth.count() / 2000)) << what;
        int drawn = 0;
        for (const float d : frame->depth.pixels()) drawn += hasPoint(d) ? 1 : 0;
        EXPECT_GT(drawn, 100) << what;
    }
};

TEST_F(GpuSurface, AgreesWithTheCpuOnTheObject) {
    const Bundle bundle = analyticBundle(AnalyticScene::object, 8, 2);
    for (const auto& [quality, name] : kQualities)
        agree(bundle, surfaceSettings(quality), analyticCamera(AnalyticScene::object, 0.4, 8),
              fmt::format("object_{}", name));
}

TEST_F(GpuSurface, AgreesWithTheCpuInTheRoom) {
    const Bundle bundle = test::smallRoom(3);
    for (const auto& [quality, name] : kQualities)
        agree(bundle, surfaceSettings(quality),
              test::small(analyticCamera(AnalyticScene::room, 0.6, 3), 256),
              fmt::format("room_{}", name));
}

TEST_F(GpuSurface, AgreesWithTheCpuFromNearAndFar) {
    const Bundle bundle = analyticBundle(AnalyticScene::object, 10, 2);
    for (const double zoom : {0.3, 3.0}) {
        Camera camera = analyticCamera(AnalyticScene::object, 2.5, 10);
        camera.fx *= zoom;
        camera.fy *= zoom * 1.1;
        camera.cx += 21;
        camera.cy -= 13;
        agree(bundle, surfaceSettings(), camera, fmt::format("zoom_{}", zoom));
    }
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

TEST_F(GpuSurface, DrawsOrthographicCameras) {
    Bundle bundle;
    for (int i = 0; i < 4; ++i) {
        Camera camera = analyticCamera(AnalyticScene::object, i, 4);
        if (i % 2 == 0)
            camera = Camera::fromFieldOfView(camera.position, camera.orientation, {2.0, 2.0}, true,
                                             200, 200);
        bundle.views.push_back(viewOfAnalyticScene(AnalyticScene::object, camera, 2));
        bundle.views.back().name = fmt::format("view{}", i);
    }
    const Camera seen = analyticCamera(AnalyticScene::object, 0.5, 4);
    const Camera camera =
        Camera::fromFieldOfView(seen.position, seen.orientation, {2.1, 2.1}, true, 220, 220);
    agree(bundle, surfaceSettings(), camera, "orthographic");
}

TEST_F(GpuSurface, LightsAsTheCpuDoes) {
    const Bundle bundle = analyticBundle(AnalyticScene::object, 4, 2);
    RenderSettings settings = surfaceSettings();
    settings.lighting.lights = {
        {Light::Kind::directional, {-1, -0.5f, -1}, {0.9f, 0.8f, 0.7f}, false}};
    settings.lighting.specular = glm::vec3(0.5f);
    const Camera camera = analyticCamera(AnalyticScene::object, 0.5, 4);
    const auto frame = draw(bundle, settings, camera);
    ASSERT_TRUE(frame) << frame.error().text();
    const Frame expected = drawOnCpu(bundle, settings, camera);
    EXPECT_GT(psnr(frame->colour, expected.colour), 45.0);
    EXPECT_GT(psnr(frame->albedo, expected.albedo), 45.0);
    EXPECT_LT(psnr(frame->colour, frame->albedo), 30.0);
}

TEST_F(GpuSurface, KeepsLinearColoursAboveOne) {
    Bundle bundle = test::smallRoom(2, 96);
    for (auto& view : bundle.views) {
        RgbaFloatImage linear(view.camera.width, view.camera.height);
        for (int y = 0; y < linear.height(); ++y)
            for (int x = 0; x < linear.width(); ++x)
                linear.at(x, y) = {glm::vec3(view.texture.at(x, y)) * 7.0f, 1.0f};
        view.texture = Texture(std::move(linear));
    }
    const Camera camera = test::small(analyticCamera(AnalyticScene::room, 0.5, 2), 96);
    const auto frame = draw(bundle, surfaceSettings(), camera);
    ASSERT_TRUE(frame) << frame.error().text();
    EXPECT_TRUE(frame->linear);
    const Frame expected = drawOnCpu(bundle, surfaceSettings(), camera);
    float most = 0;
    for (const auto& c : frame->colour.pixels()) most = std::max(most, c.r);
    EXPECT_GT(most, 3.0f);
    // Against the brightest value, 7.
    EXPECT_GT(psnr(frame->colour, expected.colour) + 20 * std::log10(7.0), 45.0);
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

TEST_F(GpuSurface, SaysNothingWhereNothingIs) {
    const Bundle bundle = analyticBundle(AnalyticScene::object, 2);
    Camera camera = analyticCamera(AnalyticScene::object, 0, 2);
    camera.orientation = glm::normalize(camera.orientation * glm::dquat(0, 0, 1, 0));  // about
    const auto frame = draw(bundle, surfaceSettings(), camera);
    ASSERT_TRUE(frame) << frame.error().text();
    for (const auto& c : frame->colour.pixels()) ASSERT_EQ(c, glm::vec4(0));
    for (const float d : frame->depth.pixels()) ASSERT_FALSE(hasPoint(d));
}

TEST_F(GpuSurface, IsTheSameEveryTimeAndFromAnotherThread) {
    const Bundle bundle = analyticBundle(AnalyticScene::object, 4, 2);
    Job job;
    auto renderer = gpu::makeGpuSurfaceRenderer(bundle, surfaceSettings(), -1, job);
    ASSERT_TRUE(renderer) << renderer.error().text();
    const Camera camera = analyticCamera(AnalyticScene::object, 0.3, 4);
    const auto here = (*renderer)->render(camera);
    ASSERT_TRUE(here);
    Result<Frame> there = fail(ErrorCode::failed, "not drawn");
    std::thread([&] { there = (*renderer)->render(camera); }).join();
    ASSERT_TRUE(there) << there.error().text();
    EXPECT_EQ(here->colour, there->colour);
    EXPECT_EQ(here->depth, there->depth);
}

TEST_F(GpuSurface, FramesExpectedAreTheSame) {
    const Bundle bundle = analyticBundle(AnalyticScene::object, 4, 2);
    Job job;
    auto plain = gpu::makeGpuSurfaceRenderer(bundle, surfaceSettings(), -1, job);
    auto told = gpu::makeGpuSurfaceRenderer(bundle, surfaceSettings(), -1, job);
    ASSERT_TRUE(plain && told);
    std::vector<Camera> cameras;
    for (const double at : {0.2, 0.4, 1.0, 1.3, 2.6, 2.8})
        cameras.push_back(analyticCamera(AnalyticScene::object, at, 4));
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        // Right, wrong (one is skipped), a reference's own pose, and one that makes no sense.
        if (i == 3) {
            (*told)->expect(cameras[5]);
        } else if (i == 4) {
            Camera none = cameras[5];
            none.width = 0;
            (*told)->expect(none);
        } else if (i + 1 < cameras.size()) {
            (*told)->expect(cameras[i + 1]);
        }
        const auto a = (*plain)->render(cameras[i]), b = (*told)->render(cameras[i]);
        ASSERT_TRUE(a && b) << i;
        EXPECT_EQ(a->colour, b->colour) << i;
        EXPECT_EQ(a->depth, b->depth) << i;
    }
    // And a frame begun that nobody asks for.
    (*told)->expect(cameras[0]);
    EXPECT_TRUE((*told)->render(cameras[1]));
}

TEST_F(GpuSurface, IsWhatTheBackendGives) {
    const Bundle bundle = analyticBundle(AnalyticScene::object, 1);
    Job job;
    const auto made = makeRenderer(Backend::gpu, bundle, surfaceSettings(), -1, job);
    ASSERT_TRUE(made) << made.error().text();
    EXPECT_EQ((*made)->backend(), "gpu");
    EXPECT_NE((*made)->device().find(listDevices(job)[0].name), std::string::npos);
}

TEST_F(GpuSurface, RefusesCamerasThatMakeNoSense) {
    const Bundle bundle = analyticBundle(AnalyticScene::object, 1);
    Camera camera = bundle.views[0].camera;
    camera.width = 0;
    const auto frame = draw(bundle, surfaceSettings(), camera);
    ASSERT_FALSE(frame);
    EXPECT_EQ(frame.error().code, ErrorCode::invalidInput);
}

}  // namespace
}  // namespace stx
