// What goes wrong with devices: little memory, a reset, old drivers, small textures.

#include "lib/render/factory.hpp"
#include "tests/unit/render_gpu/gpu_fixture.hpp"

namespace stx {
namespace {

using test::psnr;
using test::WithFaults;

RenderSettings settingsOf(RenderMode mode, GpuPipeline pipeline) {
    RenderSettings s;
    s.mode = mode;
    s.pipeline = pipeline;
    return s;
}

/// Two frames, so that what is made once and what is made for each frame both fail.
Result<Frame> twoFrames(Backend backend, const Bundle& bundle, const RenderSettings& settings) {
    Job job;
    STX_TRY(auto renderer, makeRenderer(backend, bundle, settings, -1, job));
    const Camera camera = test::small(analyticCamera(AnalyticScene::room, 0.5, 2), 48);
    renderer->expect(camera.resized(40, 30));
    STX_TRY(auto first, renderer->render(camera));
    return renderer->render(camera.resized(40, 30));
}

TEST(GpuFaults, MemoryAndDevicesThatGoMidwayEndInOneSentence) {
    REQUIRE_GPU();
    const Bundle bundle = test::smallRoom(2, 32);
    struct Trouble {
        unsigned error;
        const char* says;
    };
    for (const auto& [backend, settings] :
         {std::pair{Backend::gpu, settingsOf(RenderMode::splat, GpuPipeline::compute)},
          std::pair{Backend::gpu, settingsOf(RenderMode::splat, GpuPipeline::raster)},
          std::pair{Backend::gpu, settingsOf(RenderMode::surface, GpuPipeline::automatic)},
          std::pair{Backend::gl, settingsOf(RenderMode::splat, GpuPipeline::automatic)}}) {
        for (const auto& [error, says] : {Trouble{0x0505, "ran out of memory while"},
                                          Trouble{0x0507, "was reset or lost while"}}) {
            int failures = 0;
            // Each place that looks for errors finds one, in turn, until none is left.
            for (int n = 0; n < 100; ++n) {
                gpu::Faults faults;
                faults.errorAfter = n;
                faults.error = error;
                const WithFaults with(faults);
                const auto frame = twoFrames(backend, bundle, settings);
                if (frame) {
                    // A frame begun early fails in silence and is drawn anew; else all is done.
                    if (n > failures + 2) break;
                    continue;
                }
                ++failures;
                EXPECT_EQ(frame.error().code, ErrorCode::failed);
                EXPECT_NE(frame.error().text().find(says), std::string::npos)
                    << frame.error().text();
                EXPECT_NE(frame.error().text().find("--backend cpu"), std::string::npos);
            }
            EXPECT_GE(failures, 4) << static_cast<int>(backend);
        }
    }
}

TEST(GpuFaults, ViewsLargerThanTheTexturesAreRefusedWithTheLimit) {
    REQUIRE_GPU();
    gpu::Faults faults;
    faults.maxTextureSize = 64;
    const WithFaults with(faults);
    const Bundle bundle = test::smallRoom(2, 96);
    for (const auto mode : {RenderMode::splat, RenderMode::surface}) {
        const auto frame =
            test::drawOn(Backend::gpu, bundle, settingsOf(mode, GpuPipeline::automatic),
                         bundle.views[0].camera.resized(48, 36));
        ASSERT_FALSE(frame);
        EXPECT_EQ(frame.error().code, ErrorCode::unsupported);
        EXPECT_NE(frame.error().text().find("64"), std::string::npos) << frame.error().text();
        EXPECT_NE(frame.error().text().find("96"), std::string::npos) << frame.error().text();
    }
}

TEST(GpuFaults, SmallTexturesTakeLayersAndPieces) {
    REQUIRE_GPU();
    const Bundle bundle = test::smallRoom(5, 100);
    const Camera camera = test::small(analyticCamera(AnalyticScene::room, 2.5, 5), 300);
    for (const auto pipeline : {GpuPipeline::compute, GpuPipeline::raster}) {
        const auto settings = settingsOf(RenderMode::splat, pipeline);
        const auto expected = test::drawOn(Backend::gpu, bundle, settings, camera);
        gpu::Faults faults;
        faults.maxTextureSize = 128;
        const WithFaults with(faults);
        const auto frame = test::drawOn(Backend::gpu, bundle, settings, camera);
        ASSERT_TRUE(expected && frame) << frame.error().text();
        EXPECT_GT(psnr(frame->colour, expected->colour), 70.0);
    }
}

TEST(GpuFaults, OldDriversGetVertexTextureFetch) {
    REQUIRE_GPU();
    const Bundle bundle = analyticBundle(AnalyticScene::object, 4, 2);
    const Camera camera = analyticCamera(AnalyticScene::object, 0.5, 4);
    const auto splats = settingsOf(RenderMode::splat, GpuPipeline::automatic);
    const auto expected = test::drawOn(Backend::gpu, bundle, splats, camera);
    gpu::Faults faults;
    faults.onlyOld = true;
    const WithFaults with(faults);
    const auto frame = test::drawOn(Backend::gpu, bundle, splats, camera);
    ASSERT_TRUE(expected && frame) << frame.error().text();
    EXPECT_GT(psnr(frame->colour, expected->colour), 45.0);
    for (const auto& [backend, settings] :
         {std::pair{Backend::gpu, settingsOf(RenderMode::surface, GpuPipeline::automatic)},
          std::pair{Backend::gpu, settingsOf(RenderMode::splat, GpuPipeline::compute)},
          std::pair{Backend::gl, splats}}) {
        const auto none = test::drawOn(backend, bundle, settings, camera);
        ASSERT_FALSE(none);
        EXPECT_EQ(none.error().code, ErrorCode::unsupported);
        EXPECT_NE(none.error().text().find("needs OpenGL 4.5"), std::string::npos)
            << none.error().text();
    }
}

}  // namespace
}  // namespace stx
