#include "lib/render/gpu/gpu_splat.hpp"

#include <thread>

#include "lib/render/cpu/cpu_splat.hpp"
#include "tests/unit/gpu/gpu_fixture.hpp"

namespace stx {
namespace {

using gpu::Pipeline;
using test::coverageDifference;
using test::psnr;
using test::splatSettings;

class GpuSplat : public testing::TestWithParam<Pipeline> {
  protected:
    void SetUp() override { REQUIRE_GPU(); }

    Result<Frame> draw(const Bundle& bundle, const RenderSettings& settings, const Camera& camera) {
        Job job;
        STX_TRY(auto renderer, gpu::makeGpuSplatRenderer(bundle, settings, -1, job, GetParam()));
        return renderer->render(camera);
    }
    Frame drawOnCpu(const Bundle& bundle, const RenderSettings& settings, const Camera& camera) {
        Job job;
        auto frame = makeCpuSplatRenderer(bundle, settings, job)->render(camera);
        EXPECT_TRUE(frame) << (frame ? "" : frame.error().text());
        return frame ? std::move(*frame) : Frame{};
    }
};

TEST_P(GpuSplat, ShowsTheRoomAsItIs) {
    const Bundle bundle = test::smallRoom(3);
    const Camera camera = test::small(analyticCamera(AnalyticScene::room, 0.6, 3), 256);
    const auto truth = viewOfAnalyticScene(AnalyticScene::room, camera, 3);
    const auto frame = draw(bundle, splatSettings(), camera);
    ASSERT_TRUE(frame) << frame.error().text();
    EXPECT_GT(psnr(frame->colour, test::pictureOf(truth)), 29.0);
    int far = 0, holes = 0;
    for (std::size_t i = 0; i < frame->depth.count(); ++i) {
        const float d = frame->depth.pixels()[i], t = truth.depth.pixels()[i];
        holes += hasPoint(d) ? 0 : 1;
        far += std::abs(d - t) > 0.02f * t ? 1 : 0;
    }
    // Only what the references did not see (beside the balls) may be empty or far off.
    EXPECT_LT(holes, static_cast<int>(frame->depth.count() / 50));
    EXPECT_LT(far, static_cast<int>(frame->depth.count() / 25));
}

TEST_P(GpuSplat, ClosesTheSurfaceAtEveryZoom) {
    const Bundle bundle = test::smallRoom(1, 128);
    for (const double zoom : {1.0, 1.3, 2.0, 3.7, 8.0, 40.0}) {
        Camera camera = bundle.views[0].camera.resized(160, 120);
        camera.fx *= zoom;
        camera.fy *= zoom;
        const auto frame = draw(bundle, splatSettings(), camera);
        ASSERT_TRUE(frame) << frame.error().text();
        // A rim and what it hides may part by a pixel; a surface may not open anywhere.
        const auto truth = viewOfAnalyticScene(AnalyticScene::room, camera);
        const auto nearRim = [&](int x, int y) {
            for (int j = std::max(0, y - 2); j <= std::min(camera.height - 1, y + 2); ++j)
                for (int i = std::max(0, x - 2); i <= std::min(camera.width - 1, x + 2); ++i)
                    if (std::abs(truth.depth.at(i, j) / truth.depth.at(x, y) - 1) > 0.05f)
                        return true;
            return false;
        };
        int holes = 0;
        for (int y = 0; y < camera.height; ++y)
            for (int x = 0; x < camera.width; ++x)
                if (!hasPoint(frame->depth.at(x, y)) || frame->colour.at(x, y).a != 1.0f)
                    holes += nearRim(x, y) ? 0 : 1;
        EXPECT_EQ(holes, 0) << "zoom " << zoom;
    }
}

TEST_P(GpuSplat, AgreesWithTheCpu) {
    const Bundle bundle = analyticBundle(AnalyticScene::object, 5, 2);
    for (const SplatRule rule : {SplatRule::data, SplatRule::paper, SplatRule::point}) {
        for (const double zoom : {0.3, 1.0, 3.0}) {
            Camera camera = analyticCamera(AnalyticScene::object, 0.4, 5);
            camera.fx *= zoom;
            camera.fy *= zoom * 1.1;
            camera.cx += 21;
            camera.cy -= 13;
            const auto frame = draw(bundle, splatSettings(rule), camera);
            ASSERT_TRUE(frame) << frame.error().text();
            const Frame expected = drawOnCpu(bundle, splatSettings(rule), camera);
            EXPECT_GT(psnr(frame->colour, expected.colour), 45.0)
                << "rule " << static_cast<int>(rule) << " zoom " << zoom;
            EXPECT_LE(coverageDifference(frame->depth, expected.depth), 4);
        }
    }
}

TEST_P(GpuSplat, DrawsOrthographicCameras) {
    Bundle bundle;
    for (int i = 0; i < 4; ++i) {
        Camera camera = analyticCamera(AnalyticScene::object, i, 4);
        const glm::dvec2 window(2.0, 2.0);
        if (i % 2 == 0)
            camera = Camera::fromFieldOfView(camera.position, camera.orientation, window, true, 200,
                                             200);
        bundle.views.push_back(viewOfAnalyticScene(AnalyticScene::object, camera, 2));
        bundle.views.back().name = fmt::format("view{}", i);
    }
    const Camera seen = analyticCamera(AnalyticScene::object, 0.5, 4);
    const Camera camera =
        Camera::fromFieldOfView(seen.position, seen.orientation, {2.1, 2.1}, true, 220, 220);
    const auto frame = draw(bundle, splatSettings(), camera);
    ASSERT_TRUE(frame) << frame.error().text();
    const auto truth = viewOfAnalyticScene(AnalyticScene::object, camera, 3);
    EXPECT_GT(psnr(frame->colour, test::pictureOf(truth)), 24.0);
    EXPECT_GT(psnr(frame->colour, drawOnCpu(bundle, splatSettings(), camera).colour), 45.0);
    // The depth of an orthographic camera is the distance to its plane, too.
    double sum = 0;
    int n = 0;
    for (std::size_t i = 0; i < frame->depth.count(); ++i) {
        if (!hasPoint(frame->depth.pixels()[i]) || !hasPoint(truth.depth.pixels()[i])) continue;
        sum += std::abs(frame->depth.pixels()[i] - truth.depth.pixels()[i]);
        ++n;
    }
    ASSERT_GT(n, 5000);
    EXPECT_LT(sum / n, 0.02);
}

TEST_P(GpuSplat, LightsAsTheCpuDoes) {
    const Bundle bundle = analyticBundle(AnalyticScene::object, 4, 2);
    RenderSettings settings = splatSettings();
    settings.lighting.lights = {
        {Light::Kind::directional, {-1, -0.5f, -1}, {0.9f, 0.8f, 0.7f}, false},
        {Light::Kind::point, {1, 2, 0.5f}, {0.3f, 0.5f, 0.6f}, false},
        {Light::Kind::directional, {0, 0, -1}, {0.2f, 0.1f, 0.2f}, true}};
    settings.lighting.specular = glm::vec3(0.5f);
    settings.lighting.shininess = 20;
    const Camera camera = analyticCamera(AnalyticScene::object, 0.5, 4);
    const auto frame = draw(bundle, settings, camera);
    ASSERT_TRUE(frame) << frame.error().text();
    const Frame expected = drawOnCpu(bundle, settings, camera);
    EXPECT_GT(psnr(frame->colour, expected.colour), 45.0);
    EXPECT_GT(psnr(frame->albedo, expected.albedo), 45.0);
    // And the light does something.
    EXPECT_LT(psnr(frame->colour, frame->albedo), 30.0);

    // Each lit pixel is shadePhong() of its albedo, normal and place.
    const Lighting world = lightsInWorld(settings.lighting, camera.worldFromCamera());
    int looked = 0;
    for (int y = 4; y < camera.height; y += 9) {
        for (int x = 4; x < camera.width; x += 9) {
            const glm::vec4 albedo = frame->albedo.at(x, y);
            const glm::vec3 normal = frame->normal.at(x, y);
            if (albedo.a < 1 || normal == glm::vec3(0)) continue;
            const glm::vec3 place(camera.position +
                                  camera.orientation *
                                      camera.unproject(x + 0.5, y + 0.5, frame->depth.at(x, y)));
            const glm::vec3 lit = shadePhong(world, glm::vec3(albedo), place, normal,
                                             glm::vec3(-camera.viewDirection(x + 0.5, y + 0.5)));
            EXPECT_LT(glm::length(lit - glm::vec3(frame->colour.at(x, y))), 2e-3f) << x << "," << y;
            ++looked;
        }
    }
    EXPECT_GT(looked, 50);
}

TEST_P(GpuSplat, KeepsLinearColoursAboveOne) {
    Bundle bundle = test::smallRoom(2, 96);
    for (auto& view : bundle.views) {
        RgbaFloatImage linear(view.camera.width, view.camera.height);
        for (int y = 0; y < linear.height(); ++y)
            for (int x = 0; x < linear.width(); ++x)
                linear.at(x, y) = {glm::vec3(view.texture.at(x, y)) * 7.0f, 1.0f};
        view.texture = Texture(std::move(linear));
    }
    const Camera camera = test::small(analyticCamera(AnalyticScene::room, 0.5, 2), 96);
    const auto frame = draw(bundle, splatSettings(), camera);
    ASSERT_TRUE(frame) << frame.error().text();
    EXPECT_TRUE(frame->linear);
    const Frame expected = drawOnCpu(bundle, splatSettings(), camera);
    float most = 0;
    for (const auto& c : frame->colour.pixels()) most = std::max(most, c.r);
    EXPECT_GT(most, 3.0f);
    // Against the brightest value, 7.
    EXPECT_GT(psnr(frame->colour, expected.colour) + 20 * std::log10(7.0), 45.0);
}

TEST_P(GpuSplat, SaysNothingWhereNothingIs) {
    const Bundle bundle = analyticBundle(AnalyticScene::object, 2);
    Camera camera = analyticCamera(AnalyticScene::object, 0, 2);
    camera.orientation = glm::normalize(camera.orientation * glm::dquat(0, 0, 1, 0));  // about
    const auto frame = draw(bundle, splatSettings(), camera);
    ASSERT_TRUE(frame) << frame.error().text();
    for (const auto& c : frame->colour.pixels()) ASSERT_EQ(c, glm::vec4(0));
    for (const float d : frame->depth.pixels()) ASSERT_FALSE(hasPoint(d));
}

TEST_P(GpuSplat, RefusesCamerasThatMakeNoSense) {
    const Bundle bundle = analyticBundle(AnalyticScene::object, 1);
    Camera camera = bundle.views[0].camera;
    camera.width = 0;
    EXPECT_EQ(draw(bundle, splatSettings(), camera).error().code, ErrorCode::invalidInput);
    camera = bundle.views[0].camera;
    camera.fx = std::numeric_limits<double>::quiet_NaN();
    EXPECT_FALSE(draw(bundle, splatSettings(), camera));
    camera = bundle.views[0].camera;
    camera.width = camera.height = 100000;
    const auto huge = draw(bundle, splatSettings(), camera);
    ASSERT_FALSE(huge);
    EXPECT_NE(huge.error().message.find("100000"), std::string::npos + 1) << huge.error().text();
}

TEST_P(GpuSplat, DrawsFramesLargerThanOnePiece) {
    const Bundle bundle = test::smallRoom(1, 64);
    Camera camera = bundle.views[0].camera.resized(4500, 40);
    const auto frame = draw(bundle, splatSettings(), camera);
    ASSERT_TRUE(frame) << frame.error().text();
    for (const float d : frame->depth.pixels()) ASSERT_TRUE(hasPoint(d));
    // The seam between pieces is no edge.
    for (int y = 0; y < camera.height; ++y)
        EXPECT_LT(glm::length(frame->colour.at(4095, y) - frame->colour.at(4096, y)), 0.1f);
}

TEST_P(GpuSplat, WorksFromAnotherThread) {
    const Bundle bundle = analyticBundle(AnalyticScene::object, 2);
    Job job;
    auto renderer = gpu::makeGpuSplatRenderer(bundle, splatSettings(), -1, job, GetParam());
    ASSERT_TRUE(renderer) << renderer.error().text();
    const Camera camera = analyticCamera(AnalyticScene::object, 0.3, 2);
    const auto here = (*renderer)->render(camera);
    ASSERT_TRUE(here);
    Result<Frame> there = fail(ErrorCode::failed, "not drawn");
    std::thread([&] { there = (*renderer)->render(camera); }).join();
    ASSERT_TRUE(there) << there.error().text();
    EXPECT_GT(psnr(here->colour, there->colour), 90.0);
}

INSTANTIATE_TEST_SUITE_P(Pipelines, GpuSplat, testing::Values(Pipeline::compute, Pipeline::raster),
                         [](const auto& pipeline) {
                             return pipeline.param == Pipeline::compute ? "compute" : "raster";
                         });

TEST(Devices, AreNamed) {
    REQUIRE_GPU();
    Job job;
    for (const auto& device : listDevices(job)) {
        EXPECT_FALSE(device.name.empty());
        EXPECT_NE(device.version.find("4."), std::string::npos);
        EXPECT_GE(device.maxTextureSize, 4096);
    }
}

TEST(Devices, OneThatIsNotThereIsRefused) {
    REQUIRE_GPU();
    const Bundle bundle = analyticBundle(AnalyticScene::object, 1);
    Job job;
    const auto made = makeRenderer(Backend::gpu, bundle, splatSettings(), 99, job);
    ASSERT_FALSE(made);
    EXPECT_EQ(made.error().code, ErrorCode::usage);
    EXPECT_NE(made.error().message.find("device 99"), std::string::npos);
}

TEST(Devices, AutomaticPrefersTheCpuToASoftwareDriver) {
    REQUIRE_GPU();
    Job job;
    for (const auto& device : listDevices(job))
        if (!device.software) GTEST_SKIP() << "a hardware GPU is here";
    const Bundle bundle = analyticBundle(AnalyticScene::object, 1);
    const auto made = makeRenderer(Backend::automatic, bundle, splatSettings(), -1, job);
    ASSERT_TRUE(made) << made.error().text();
    EXPECT_EQ((*made)->backend(), "cpu");
}

}  // namespace
}  // namespace stx
