#include "lib/render/compose/footprint.hpp"
#include "lib/render/factory.hpp"

#include <gtest/gtest.h>

#include "lib/render/splat/cpu/cpu_splat.hpp"
#include "lib/render/surface/cpu/cpu_surface.hpp"
#include "tests/unit/render_gpu/gpu_fixture.hpp"

namespace stx {
namespace {

Camera smallCamera(int divisor) {
    const Camera c = analyticCamera(AnalyticScene::object, 0.5, 8);
    return c.resized(c.width / divisor, c.height / divisor);
}

const ShareLength kNear(Camera(), 10);

TEST(Footprint, CountsTheSamplesOfAPixel) {
    const Bundle bundle = analyticBundle(AnalyticScene::object, 8);
    const Footprint footprint(bundle);
    EXPECT_NEAR(footprint.samplesPerPixel(bundle.views[3].camera), 1.0, 0.15);
    EXPECT_NEAR(footprint.samplesPerPixel(smallCamera(4)), 4.0, 0.6);
    Camera away = smallCamera(4);
    away.orientation = glm::normalize(away.orientation * glm::dquat(0, 0, 1, 0));
    EXPECT_EQ(footprint.samplesPerPixel(away), 1.0);
}

TEST(Footprint, DepthIsThatAtThePixelsCentre) {
    for (const int factor : {2, 3, 4}) {
        for (const bool lit : {false, true}) {
            Frame large;
            large.colour = Image<glm::vec4>(8 * factor, 6 * factor, glm::vec4(1));
            large.depth = Image<float>(8 * factor, 6 * factor);
            if (lit) large.normal = Image<glm::vec3>(8 * factor, 6 * factor, {0, 0, 1});
            const auto plane = [](double x, double y) { return 5 + 0.02 * x - 0.03 * y; };
            for (int y = 0; y < large.depth.height(); ++y)
                for (int x = 0; x < large.depth.width(); ++x)
                    large.depth.at(x, y) =
                        static_cast<float>(plane((x + 0.5) / factor, (y + 0.5) / factor));
            // In front of all else: an edge is not averaged.
            large.depth.at(2 * factor, 2 * factor) = 1;
            const Frame small = minified(large, factor, kNear);
            for (int y = 0; y < 6; ++y)
                for (int x = 0; x < 8; ++x) {
                    if (x == 2 && y == 2) continue;
                    EXPECT_NEAR(small.depth.at(x, y), plane(x + 0.5, y + 0.5), 1e-5) << factor;
                }
            const float there = small.depth.at(2, 2);
            EXPECT_TRUE(there == 1 || std::abs(there - plane(2.5, 2.5)) < 0.03) << there;
        }
    }
}

/// 1 % of the distance is more than the scene is deep: two plates, one a little before the other,
/// had a depth in the air between them.
TEST(Footprint, DepthFromFarAwayIsOnOneOfTwoSurfaces) {
    for (const bool orthographic : {false, true}) {
        for (const double eye : {100.0, 1000.0}) {
            Camera camera;
            camera.orthographic = orthographic;
            camera.width = camera.height = 8;
            camera.fx = camera.fy = orthographic ? 2.5 : 2.5 * eye;
            const auto nearer = static_cast<float>(eye - 0.3), farther = nearer + 0.6f;
            for (const int factor : {2, 4}) {
                Frame large;
                large.colour = Image<glm::vec4>(8 * factor, 8 * factor, glm::vec4(1));
                large.depth = Image<float>(8 * factor, 8 * factor, farther);
                // The edge is in the middle of a pixel.
                for (int y = 0; y < large.depth.height(); ++y)
                    for (int x = 0; x < 4 * factor + factor / 2; ++x) large.depth.at(x, y) = nearer;
                const Frame small = minified(large, factor, ShareLength(camera, 1.5));
                for (const float depth : small.depth.pixels())
                    EXPECT_TRUE(depth == nearer || depth == farther) << depth;
            }
        }
    }
}

TEST(Footprint, SmallPicturesAreAveraged) {
    const Bundle bundle = analyticBundle(AnalyticScene::object, 8, 2);
    const Camera camera = smallCamera(4);
    const auto truth = test::pictureOf(viewOfAnalyticScene(AnalyticScene::object, camera, 16));
    Job job;
    for (const auto mode : {RenderMode::surface, RenderMode::splat}) {
        RenderSettings settings;
        settings.mode = mode;
        const auto plain = mode == RenderMode::surface
                               ? makeCpuSurfaceRenderer(bundle, settings, job)
                               : makeCpuSplatRenderer(bundle, settings, job);
        const auto made = makeRenderer(Backend::cpu, bundle, settings, -1, job);
        ASSERT_TRUE(made);
        const auto a = plain->render(camera), b = (*made)->render(camera);
        ASSERT_TRUE(a && b);
        EXPECT_EQ(b->colour.size(), a->colour.size());
        const double before = test::psnr(a->colour, truth), after = test::psnr(b->colour, truth);
        RecordProperty(mode == RenderMode::surface ? "surface" : "splat",
                       fmt::format("{:.1f} -> {:.1f} dB", before, after));
        EXPECT_GT(after, before + 3.0);
        EXPECT_GT(after, 33.0);
    }
}

TEST(Footprint, LeavesPicturesAsLargeAsTheViewsAlone) {
    const Bundle bundle = analyticBundle(AnalyticScene::object, 8, 2);
    const Camera camera = analyticCamera(AnalyticScene::object, 0.5, 8);
    Job job;
    const RenderSettings settings;
    const auto plain = makeCpuSurfaceRenderer(bundle, settings, job)->render(camera);
    const auto made = makeRenderer(Backend::cpu, bundle, settings, -1, job);
    ASSERT_TRUE(made && plain);
    EXPECT_EQ((*made)->render(camera)->colour, plain->colour);
}

/// The large views have several samples to a pixel of the small one, whose own they are not.
TEST(Footprint, GivesBackASmallViewAmongLargeOnes) {
    Bundle bundle = analyticBundle(AnalyticScene::object, 8, 1);
    Camera small = bundle.views[2].camera;
    small = small.resized(small.width / 4, small.height / 4);
    bundle.views[2] = viewOfAnalyticScene(AnalyticScene::object, small, 1);
    Job job;
    const auto made = makeRenderer(Backend::cpu, bundle, {}, -1, job);
    ASSERT_TRUE(made);
    EXPECT_GT(Footprint(bundle).samplesPerPixel(small), 2.0);
    const auto frame = (*made)->render(small);
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->depth, bundle.views[2].depth);
}

TEST(Footprint, AveragesWhatIsThere) {
    Frame large;
    large.colour = Image<glm::vec4>(4, 2, glm::vec4(0.0f));
    large.albedo = large.colour;
    large.depth = Image<float>(4, 2, kNoDepth);
    large.normal = Image<glm::vec3>(4, 2, glm::vec3(0.0f));
    for (const auto& [x, y] : {std::pair{0, 0}, {1, 1}, {2, 0}}) {
        large.colour.at(x, y) = glm::vec4(0.5f, 1.0f, 0.25f, 1.0f);
        large.albedo.at(x, y) = glm::vec4(1.0f);
        large.depth.at(x, y) = 3.0f;
        large.normal.at(x, y) = glm::vec3(0, 0, 1);
    }
    const Frame small = minified(large, 2, kNear);
    ASSERT_EQ(small.colour.size(), glm::ivec2(2, 1));
    EXPECT_EQ(small.colour.at(0, 0), glm::vec4(0.25f, 0.5f, 0.125f, 0.5f));
    EXPECT_EQ(small.albedo.at(0, 0), glm::vec4(0.5f));
    EXPECT_EQ(small.normal.at(0, 0), glm::vec3(0, 0, 1));
    EXPECT_EQ(small.depth.at(0, 0), 3.0f);
    // A quarter covered: colour fades, and there is no depth to speak of.
    EXPECT_EQ(small.colour.at(1, 0).a, 0.25f);
    EXPECT_FALSE(hasPoint(small.depth.at(1, 0)));

    // The same of colour and depth alone, which has a loop of its own.
    large.albedo = {};
    large.normal = {};
    const Frame plain = minified(large, 2, kNear);
    EXPECT_TRUE(plain.colour == small.colour && plain.depth == small.depth);
    EXPECT_TRUE(plain.albedo.empty() && plain.normal.empty());
}

}  // namespace
}  // namespace stx
