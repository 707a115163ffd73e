#include "lib/render/splat/gpu/gpu_splat.hpp"
#include "lib/render/factory.hpp"

#include "tests/unit/render_gpu/gpu_fixture.hpp"

namespace stx {
namespace {

using test::coverageDifference;
using test::drawOnCpu;
using test::psnr;
using test::splatSettings;

class GpuSplat : public testing::TestWithParam<GpuPipeline> {
  protected:
    void SetUp() override { REQUIRE_GPU(); }

    static Result<Frame> draw(const Bundle& bundle, RenderSettings settings, const Camera& camera) {
        settings.pipeline = GetParam();
        return test::drawOn(Backend::gpu, bundle, settings, camera);
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

/// Float colours whose alpha is `alpha` where the object is.
Bundle glassObject(float alpha) {
    Bundle bundle = analyticBundle(AnalyticScene::object, 5);
    for (auto& view : bundle.views) {
        RgbaFloatImage light(view.camera.width, view.camera.height);
        for (std::size_t i = 0; i < light.count(); ++i) {
            const glm::vec4 c = view.texture.at(i);
            light.data()[i] = {glm::vec3(c), c.a * alpha};
        }
        view.texture = Texture(std::move(light));
    }
    return bundle;
}

/// An alpha of exactly one half hid what is behind on the processor and not on a GPU. Below that
/// glass had no depth on either.
TEST_P(GpuSplat, AgreesWithTheCpuOnGlass) {
    const Camera camera = analyticCamera(AnalyticScene::object, 0.4, 5);
    for (const float alpha : {0.5f, 0.3f}) {
        const Bundle bundle = glassObject(alpha);
        test::expectAgreement(draw(bundle, splatSettings(), camera),
                              drawOnCpu(bundle, splatSettings(), camera),
                              fmt::format("alpha {}", alpha));
    }
}

/// Where what blends with the front is held to the scene.
TEST_P(GpuSplat, AgreesWithTheCpuFromFarAway) {
    const Bundle bundle = analyticBundle(AnalyticScene::object, 5, 2);
    for (const bool orthographic : {false, true}) {
        Camera camera = analyticCamera(AnalyticScene::object, 0.4, 5);
        const double distance = glm::length(camera.position);
        camera.position *= 100.0;
        camera.orthographic = orthographic;
        camera.fx *= orthographic ? 1 / distance : 100.0;
        camera.fy = camera.fx;
        const auto frame = draw(bundle, splatSettings(), camera);
        test::expectAgreement(frame, drawOnCpu(bundle, splatSettings(), camera),
                              orthographic ? "orthographic" : "perspective");
    }
}

/// A thousandth of a unit of a wall, whose samples lie hundreds of pixels and more apart.
TEST_P(GpuSplat, FillsOrthographicCloseUps) {
    const Bundle bundle = test::smallRoom(1, 128);
    Camera camera = bundle.views[0].camera.resized(160, 120);
    camera.orthographic = true;
    camera.fx = camera.fy = 160 / 0.001;
    camera.cx = 80;
    camera.cy = 60;
    const auto frame = draw(bundle, splatSettings(), camera);
    test::expectAgreement(frame, drawOnCpu(bundle, splatSettings(), camera), "close-up");
    for (const float d : frame->depth.pixels()) ASSERT_TRUE(hasPoint(d));
}

TEST_P(GpuSplat, DrawsFramesLargerThanOnePiece) {
    const Bundle bundle = test::smallRoom(1, 64);
    Camera camera = bundle.views[0].camera.resized(4500, 40);
    const auto frame = draw(bundle, splatSettings(), camera);
    ASSERT_TRUE(frame) << frame.error().text();
    for (const float d : frame->depth.pixels()) ASSERT_TRUE(hasPoint(d));
    // The seam between pieces is not an edge.
    for (int y = 0; y < camera.height; ++y)
        EXPECT_LT(glm::length(frame->colour.at(4095, y) - frame->colour.at(4096, y)), 0.1f);
}

INSTANTIATE_TEST_SUITE_P(Pipelines, GpuSplat,
                         testing::Values(GpuPipeline::compute, GpuPipeline::raster),
                         [](const auto& pipeline) {
                             return pipeline.param == GpuPipeline::compute ? "compute" : "raster";
                         });

/// A coloured wall, seen by one view, and a board before it, seen by another that stands beside.
Bundle wallBehindBoard() {
    Bundle bundle;
    for (const bool board : {false, true}) {
        ReferenceView view;
        view.name = board ? "board" : "wall";
        view.camera = Camera::fromFieldOfView(glm::dvec3(board ? 0.1 : -0.1, 0, 0), {1, 0, 0, 0},
                                              {1.0, 1.0}, false, 192, 192);
        view.nearPlane = 1;
        view.farPlane = 10;
        view.depth = Image<float>(192, 192, 5.0f);
        Rgba8Image texture(192, 192);
        for (int y = 0; y < 192; ++y) {
            for (int x = 0; x < 192; ++x) {
                const bool on = board && x >= 40 && x < 152 && y >= 40 && y < 152;
                if (on) view.depth.at(x, y) = 2.0f;
                texture.at(x, y) = on ? glm::u8vec4(200, x, y, 255) : glm::u8vec4(x, 50, y, 255);
            }
        }
        view.texture = Texture(std::move(texture));
        bundle.views.push_back(std::move(view));
    }
    return bundle;
}

TEST(GpuSplatCulling, LeavesOutHiddenBlocksAndNothingElse) {
    REQUIRE_GPU();
    const Bundle bundle = wallBehindBoard();
    RenderSettings settings = splatSettings();
    settings.pipeline = GpuPipeline::compute;
    Job job;
    const auto culling = gpu::makeGpuSplatRenderer(bundle, settings, -1, job);
    settings.without.add(Stage::cull);
    const auto plain = gpu::makeGpuSplatRenderer(bundle, settings, -1, job);
    ASSERT_TRUE(culling && plain);
    for (const double zoom : {0.5, 1.0, 4.0}) {
        Camera camera = bundle.views[1].camera;
        camera.position.y += 0.05;
        camera.fx *= zoom;
        camera.fy *= zoom;
        const auto a = (*culling)->render(camera), b = (*plain)->render(camera);
        ASSERT_TRUE(a && b);
        EXPECT_EQ(a->colour, b->colour) << zoom;
        EXPECT_EQ(a->depth, b->depth) << zoom;
        const auto counts = gpu::lastSplatCounts(**culling);
        RecordProperty(fmt::format("zoom_{}", zoom),
                       fmt::format("{} of {} blocks hidden", counts.hidden, counts.tasks));
        // The board covers 7x7 of the wall's 12x12 blocks.
        EXPECT_GE(counts.hidden, zoom < 1 ? 4 : 16) << zoom;
        EXPECT_LT(counts.hidden, counts.tasks);
        EXPECT_EQ(gpu::lastSplatCounts(**plain).hidden, 0);
    }
}

TEST(Pipelines, AreChosenByWhatTheDeviceHas) {
    Device device;
    gpu::ContextAbilities able;
    // OpenGL 3.3.
    EXPECT_EQ(gpu::choosePipeline(device, able).pipeline, GpuPipeline::raster);
    device.software = true;
    EXPECT_EQ(gpu::choosePipeline(device, able).pipeline, GpuPipeline::raster);
    able.modern = true;
    EXPECT_EQ(gpu::choosePipeline(device, able).pipeline, GpuPipeline::compute);
    device.software = false;
    EXPECT_EQ(gpu::choosePipeline(device, able).pipeline, GpuPipeline::raster);
    able.atomicInt64 = true;
    EXPECT_EQ(gpu::choosePipeline(device, able).pipeline, GpuPipeline::compute);
}

TEST(Devices, AreNamed) {
    REQUIRE_GPU();
    Job job;
    for (const auto& device : listDevices(job)) {
        EXPECT_FALSE(device.name.empty());
        EXPECT_NE(device.version.find(test::askedDriver() == "softpipe" ? "3.3" : "4."),
                  std::string::npos)
            << device.version;
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
