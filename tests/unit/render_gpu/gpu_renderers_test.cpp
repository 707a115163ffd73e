// What every renderer on a GPU must do, whatever its mode and pipeline.

#include <thread>

#include "lib/packing/packing.hpp"
#include "lib/packing/prune.hpp"
#include "lib/render/factory.hpp"
#include "tests/painted_environment.hpp"
#include "tests/torus_bundle.hpp"
#include "tests/unit/render_gpu/gpu_fixture.hpp"
#include "tests/unit/surface/analytic.hpp"
#include "tests/wall_with_block.hpp"

namespace stx {
namespace {

using test::coverageDifference;
using test::drawOnCpu;
using test::psnr;

struct Way {
    const char* name;
    RenderMode mode;
    GpuPipeline pipeline;
};
void PrintTo(const Way& way, std::ostream* out) {
    *out << way.name;
}

class GpuRenderers : public testing::TestWithParam<Way> {
  protected:
    void SetUp() override { REQUIRE_GPU(); }

    static RenderSettings settings() {
        RenderSettings s;
        s.mode = GetParam().mode;
        s.pipeline = GetParam().pipeline;
        return s;
    }
    static Result<Frame> draw(const Bundle& bundle, const RenderSettings& settings,
                              const Camera& camera) {
        return test::drawOn(Backend::gpu, bundle, settings, camera);
    }
    /// Draws with both and holds one against the other.
    static void agree(const Bundle& bundle, const RenderSettings& settings, const Camera& camera,
                      const std::string& what) {
        test::expectAgreement(draw(bundle, settings, camera), drawOnCpu(bundle, settings, camera),
                              what, 4);
    }
};

TEST_P(GpuRenderers, AgreeWithTheCpuFromNearAndFar) {
    const Bundle bundle = analyticBundle(AnalyticScene::object, 10, 2);
    for (const double zoom : {0.3, 1.0, 3.0}) {
        Camera camera = analyticCamera(AnalyticScene::object, 2.5, 10);
        camera.fx *= zoom;
        camera.fy *= zoom * 1.1;
        camera.cx += 21;
        camera.cy -= 13;
        agree(bundle, settings(), camera, fmt::format("zoom_{}", zoom));
    }
}

/// Rectangles of several views on one texture, some of them turned, with pixels pruned between
/// them.
TEST_P(GpuRenderers, DrawAtlasesFromTheirTextures) {
    Job job;
    Result<Atlas> atlas = Atlas();
    const auto isTurned = [](const AtlasRectangle& r) { return r.turned; };
    // Which size packs best with turned rectangles is the packer's business.
    for (const int size : {128, 112, 100, 144, 90, 160}) {
        Bundle bundle = torusViews(size);
        const auto report = prune(bundle, {}, job);
        ASSERT_TRUE(report);
        PackSettings packing;
        packing.layout = PackSettings::Layout::tight;
        packing.sourcePixels = report->sourcePixels;
        atlas = pack(std::move(bundle), packing, job);
        ASSERT_TRUE(atlas);
        if (std::ranges::any_of(atlas->rectangles, isTurned)) break;
    }
    EXPECT_TRUE(std::ranges::any_of(atlas->rectangles, isTurned));
    const Camera camera = analytic::lookingAt({1, 2, 2}, 160);
    for (const bool lit : {false, true}) {
        RenderSettings s = settings();
        if (lit) s.lighting.lights.emplace_back();
        const auto expected = test::drawOn(Backend::cpu, *atlas, s, camera);
        ASSERT_TRUE(expected);
        test::expectAgreement(test::drawOn(Backend::gpu, *atlas, s, camera), *expected,
                              lit ? "lit" : "unlit", 20);
    }
}

TEST_P(GpuRenderers, DrawTheBackgroundBehind) {
    agree(test::wallWithBackground(), settings(), test::besideWall(), "background");
}

TEST_P(GpuRenderers, DrawOrthographicCameras) {
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
    agree(bundle, settings(), camera, "orthographic");
    // The depth of an orthographic camera is the distance to its plane, too.
    const auto frame = draw(bundle, settings(), camera);
    ASSERT_TRUE(frame);
    const auto truth = viewOfAnalyticScene(AnalyticScene::object, camera, 3);
    EXPECT_GT(psnr(frame->colour, test::pictureOf(truth)), 24.0);
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

TEST_P(GpuRenderers, LightAsTheCpuDoes) {
    const Bundle bundle = analyticBundle(AnalyticScene::object, 4, 2);
    RenderSettings s = settings();
    s.lighting.lights = {{Light::Kind::directional, {-1, -0.5f, -1}, {0.9f, 0.8f, 0.7f}, false},
                         {Light::Kind::point, {1, 2, 0.5f}, {0.3f, 0.5f, 0.6f}, false},
                         {Light::Kind::directional, {0, 0, -1}, {0.2f, 0.1f, 0.2f}, true}};
    s.lighting.specular = glm::vec3(0.5f);
    s.lighting.shininess = 20;
    const Camera camera = analyticCamera(AnalyticScene::object, 0.5, 4);
    const auto frame = draw(bundle, s, camera);
    ASSERT_TRUE(frame) << frame.error().text();
    const Frame expected = drawOnCpu(bundle, s, camera);
    EXPECT_GT(psnr(frame->colour, expected.colour), 45.0);
    EXPECT_GT(psnr(frame->albedo, expected.albedo), 45.0);
    // And the light does something.
    EXPECT_LT(psnr(frame->colour, frame->albedo), 30.0);

    // Each lit pixel is shadePhong() of its albedo, normal and place.
    const Lighting world = lightsInWorld(s.lighting, camera.worldFromCamera());
    int looked = 0;
    for (int y = 4; y < camera.height; y += 9) {
        for (int x = 4; x < camera.width; x += 9) {
            const glm::vec4 albedo = frame->albedo.at(x, y);
            const glm::vec3 normal = frame->normal.at(x, y);
            if (albedo.a < 1 || normal == glm::vec3(0)) continue;
            const glm::vec3 place(camera.position +
                                  camera.orientation *
                                      camera.unproject(x + 0.5, y + 0.5, frame->depth.at(x, y)));
            const glm::vec3 lit =
                shadePhong(world, glm::vec3(albedo), place, normal,
                           glm::vec3(-camera.viewDirection(x + 0.5, y + 0.5)), false);
            EXPECT_LT(glm::length(lit - glm::vec3(frame->colour.at(x, y))), 2e-3f) << x << "," << y;
            ++looked;
        }
    }
    EXPECT_GT(looked, 50);
}

TEST_P(GpuRenderers, KeepLightBeyondOneWhereTheyMay) {
    const Bundle bundle = analyticBundle(AnalyticScene::object, 4, 2);
    RenderSettings s = settings();
    s.lighting.lights = {{Light::Kind::directional, {0, 0, -1}, glm::vec3(4), true}};
    const Camera camera = analyticCamera(AnalyticScene::object, 0.5, 4);
    const auto brightest = [](const Frame& frame) {
        float most = 0;
        for (const auto& p : frame.colour.pixels()) most = std::max({most, p.r, p.g, p.b});
        return most;
    };
    const auto stopped = draw(bundle, s, camera);
    ASSERT_TRUE(stopped) << stopped.error().text();
    EXPECT_LE(brightest(*stopped), 1.0f);
    s.lighting.beyondOne = true;
    const auto frame = draw(bundle, s, camera);
    ASSERT_TRUE(frame) << frame.error().text();
    EXPECT_GT(brightest(*frame), 1.2f);
    EXPECT_GT(psnr(frame->colour, drawOnCpu(bundle, s, camera).colour), 45.0);
}

TEST_P(GpuRenderers, AreLitByAnEnvironmentAsOnTheCpu) {
    const Bundle bundle = analyticBundle(AnalyticScene::object, 4, 2);
    const auto map = EnvironmentMap::make(paintedCube(32), Limits());
    ASSERT_TRUE(map);
    RenderSettings s = settings();
    s.lighting.ambient = glm::vec3(0.0f);
    s.lighting.shininess = 20;
    const auto light = EnvironmentLight::make(*map, s.lighting.shininess, Limits());
    ASSERT_TRUE(light);
    s.lighting.environment = *light;
    const Camera camera = analyticCamera(AnalyticScene::object, 0.5, 4);
    std::vector<Frame> frames;
    for (const float specular : {0.0f, 0.4f}) {
        s.lighting.specular = glm::vec3(specular);
        auto frame = draw(bundle, s, camera);
        ASSERT_TRUE(frame) << frame.error().text();
        EXPECT_GT(psnr(frame->colour, drawOnCpu(bundle, s, camera).colour), 45.0);
        frames.push_back(std::move(*frame));
    }
    // And the gloss does something.
    EXPECT_LT(psnr(frames[0].colour, frames[1].colour), 35.0);
}

TEST_P(GpuRenderers, GiveNormalsWithoutLightToo) {
    const Bundle bundle = analyticBundle(AnalyticScene::object, 4, 2);
    RenderSettings s = settings();
    const Camera camera = analyticCamera(AnalyticScene::object, 0.5, 4);
    const auto plain = draw(bundle, s, camera);
    s.normals = true;
    const auto frame = draw(bundle, s, camera);
    ASSERT_TRUE(plain && frame);
    EXPECT_TRUE(plain->normal.empty());
    EXPECT_EQ(plain->colour, frame->colour);
    EXPECT_EQ(frame->albedo, frame->colour);
    const Frame expected = drawOnCpu(bundle, s, camera);
    EXPECT_EQ(expected.albedo, expected.colour);
    int same = 0, both = 0;
    for (std::size_t i = 0; i < frame->normal.count(); ++i) {
        const glm::vec3 a = frame->normal.pixels()[i], b = expected.normal.pixels()[i];
        if (a == glm::vec3(0) || b == glm::vec3(0)) continue;
        EXPECT_NEAR(glm::length(a), 1.0f, 1e-3f);
        ++both;
        same += glm::dot(a, b) > 0.999f ? 1 : 0;
    }
    EXPECT_GT(both, 5000);
    EXPECT_GT(same, both * 99 / 100);
}

TEST_P(GpuRenderers, KeepLinearColoursAboveOne) {
    Bundle bundle = test::smallRoom(2, 96);
    for (auto& view : bundle.views) {
        RgbaFloatImage linear(view.camera.width, view.camera.height);
        for (int y = 0; y < linear.height(); ++y)
            for (int x = 0; x < linear.width(); ++x)
                linear.at(x, y) = {glm::vec3(view.texture.at(x, y)) * 7.0f, 1.0f};
        view.texture = Texture(std::move(linear));
    }
    const Camera camera = test::small(analyticCamera(AnalyticScene::room, 0.5, 2), 96);
    const auto frame = draw(bundle, settings(), camera);
    ASSERT_TRUE(frame) << frame.error().text();
    EXPECT_TRUE(frame->linear);
    const Frame expected = drawOnCpu(bundle, settings(), camera);
    float most = 0;
    for (const auto& c : frame->colour.pixels()) most = std::max(most, c.r);
    EXPECT_GT(most, 3.0f);
    // Against the brightest value, 7.
    EXPECT_GT(psnr(frame->colour, expected.colour) + 20 * std::log10(7.0), 45.0);
}

TEST_P(GpuRenderers, AverageSmallPicturesAsTheCpuDoes) {
    const Bundle bundle = analyticBundle(AnalyticScene::object, 4, 2);
    const Camera camera = analyticCamera(AnalyticScene::object, 0.5, 4);
    const Camera small = camera.resized(camera.width / 4, camera.height / 4);
    agree(bundle, settings(), small, "small");
    const auto truth = viewOfAnalyticScene(AnalyticScene::object, small, 16);
    const auto frame = draw(bundle, settings(), small);
    ASSERT_TRUE(frame);
    EXPECT_GT(psnr(frame->colour, test::pictureOf(truth)), 33.0);
}

TEST_P(GpuRenderers, SayNothingWhereNothingIs) {
    const Bundle bundle = analyticBundle(AnalyticScene::object, 2);
    Camera camera = analyticCamera(AnalyticScene::object, 0, 2);
    camera.orientation = glm::normalize(camera.orientation * glm::dquat(0, 0, 1, 0));  // about
    const auto frame = draw(bundle, settings(), camera);
    ASSERT_TRUE(frame) << frame.error().text();
    for (const auto& c : frame->colour.pixels()) ASSERT_EQ(c, glm::vec4(0));
    for (const float d : frame->depth.pixels()) ASSERT_FALSE(hasPoint(d));
}

TEST_P(GpuRenderers, RefuseCamerasThatMakeNoSense) {
    const Bundle bundle = analyticBundle(AnalyticScene::object, 1);
    Camera camera = bundle.views[0].camera;
    camera.width = 0;
    auto frame = draw(bundle, settings(), camera);
    ASSERT_FALSE(frame);
    EXPECT_EQ(frame.error().code, ErrorCode::invalidInput);
    camera = bundle.views[0].camera;
    camera.fx = std::numeric_limits<double>::quiet_NaN();
    EXPECT_FALSE(draw(bundle, settings(), camera));
    camera = bundle.views[0].camera;
    camera.width = camera.height = 100000;
    frame = draw(bundle, settings(), camera);
    ASSERT_FALSE(frame);
    EXPECT_FALSE(frame.error().text().empty());
}

TEST_P(GpuRenderers, AreTheSameFromAnotherThread) {
    const Bundle bundle = analyticBundle(AnalyticScene::object, 4, 2);
    Job job;
    auto renderer = makeRenderer(Backend::gpu, bundle, settings(), -1, job);
    ASSERT_TRUE(renderer) << renderer.error().text();
    const Camera camera = analyticCamera(AnalyticScene::object, 0.3, 4);
    const auto here = (*renderer)->render(camera);
    ASSERT_TRUE(here);
    Result<Frame> there = fail(ErrorCode::failed, "not drawn");
    std::thread([&] { there = (*renderer)->render(camera); }).join();
    ASSERT_TRUE(there) << there.error().text();
    EXPECT_GT(psnr(here->colour, there->colour), 90.0);
    EXPECT_EQ(here->depth, there->depth);
}

TEST_P(GpuRenderers, FramesExpectedAreTheSame) {
    const Bundle bundle = analyticBundle(AnalyticScene::object, 4, 2);
    Job job;
    auto plain = makeRenderer(Backend::gpu, bundle, settings(), -1, job);
    auto expecting = makeRenderer(Backend::gpu, bundle, settings(), -1, job);
    ASSERT_TRUE(plain && expecting);
    std::vector<Camera> cameras;
    for (const double at : {0.2, 0.4, 1.0, 1.3, 2.6, 2.8})
        cameras.push_back(analyticCamera(AnalyticScene::object, at, 4));
    // One of another size, in the middle.
    cameras[2] = cameras[2].resized(300, 190);
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        // Right, wrong (one is skipped), and one that makes no sense.
        if (i == 3) {
            (*expecting)->expect(cameras[5]);
        } else if (i == 4) {
            Camera none = cameras[5];
            none.width = 0;
            (*expecting)->expect(none);
        } else if (i + 1 < cameras.size()) {
            (*expecting)->expect(cameras[i + 1]);
        }
        const auto a = (*plain)->render(cameras[i]), b = (*expecting)->render(cameras[i]);
        ASSERT_TRUE(a && b) << i;
        EXPECT_GT(psnr(a->colour, b->colour), 90.0) << i;
        EXPECT_EQ(a->depth, b->depth) << i;
    }
    // And a frame begun that nobody asks for.
    (*expecting)->expect(cameras[0]);
    EXPECT_TRUE((*expecting)->render(cameras[1]));
}

TEST_P(GpuRenderers, FramesExpectedHaveTheLightsThatAreAskedFor) {
    const Bundle bundle = analyticBundle(AnalyticScene::object, 4, 2);
    RenderSettings s = settings();
    s.lighting.lights = {{Light::Kind::directional, {0, 0, -1}, glm::vec3(1), true}};
    Job job;
    auto plain = makeRenderer(Backend::gpu, bundle, s, -1, job);
    auto expecting = makeRenderer(Backend::gpu, bundle, s, -1, job);
    ASSERT_TRUE(plain && expecting);
    const Camera first = analyticCamera(AnalyticScene::object, 0.2, 4),
                 second = analyticCamera(AnalyticScene::object, 0.4, 4),
                 pose = analyticCamera(AnalyticScene::object, 1.4, 4);
    (*expecting)->expect(second);
    ASSERT_TRUE((*expecting)->render(first));
    const auto own = (*plain)->render(second);
    for (auto* renderer : {&plain, &expecting}) (**renderer)->lightFrom(pose);
    const auto a = (*plain)->render(second), b = (*expecting)->render(second);
    ASSERT_TRUE(own && a && b);
    EXPECT_GT(psnr(a->colour, b->colour), 90.0);
    EXPECT_LT(psnr(a->colour, own->colour), 30.0);
    (*expecting)->lightFrom(std::nullopt);
    const auto again = (*expecting)->render(second);
    ASSERT_TRUE(again);
    EXPECT_GT(psnr(again->colour, own->colour), 90.0);
}

TEST_P(GpuRenderers, SayWhereTheyDraw) {
    const Bundle bundle = analyticBundle(AnalyticScene::object, 1);
    Job job;
    const auto made = makeRenderer(Backend::gpu, bundle, settings(), -1, job);
    ASSERT_TRUE(made) << made.error().text();
    EXPECT_EQ((*made)->backend(), "gpu");
    EXPECT_NE((*made)->device().find(listDevices(job)[0].name), std::string::npos);
}

INSTANTIATE_TEST_SUITE_P(Ways, GpuRenderers,
                         testing::Values(Way{"compute", RenderMode::splat, GpuPipeline::compute},
                                         Way{"raster", RenderMode::splat, GpuPipeline::raster},
                                         Way{"surface", RenderMode::surface,
                                             GpuPipeline::automatic}),
                         [](const auto& way) { return way.param.name; });

}  // namespace
}  // namespace stx
