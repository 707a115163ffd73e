#include "lib/render/splat/cpu/cpu_splat.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include "lib/base/parallel.hpp"
#include "lib/metrics/compare.hpp"
#include "lib/render/bench/analytic_scene.hpp"
#include "lib/render/splat/others.hpp"
#include "lib/render/splat/plan.hpp"

namespace stx {
namespace {

// A view of one plane z = -distance + tilt * x in the world, coloured by `colour` (x, y, depth).
template <class F>
ReferenceView planeView(const Camera& camera, double distance, double tilt, const F& colour) {
    ReferenceView v;
    v.name = "plane";
    v.camera = camera;
    Rgba8Image image(camera.width, camera.height);
    v.depth = Image<float>(camera.width, camera.height, kNoDepth);
    for (int y = 0; y < camera.height; ++y) {
        for (int x = 0; x < camera.width; ++x) {
            const glm::dvec3 a =
                camera.position + camera.orientation * camera.unproject(x + 0.5, y + 0.5, 0.0);
            const glm::dvec3 b =
                camera.position + camera.orientation * camera.unproject(x + 0.5, y + 0.5, 1.0);
            // a + t (b - a) on the plane.
            const double at = a.z + distance - tilt * a.x, per = (b.z - a.z) - tilt * (b.x - a.x);
            const double depth = -at / per;
            if (!(depth > 0)) continue;
            v.depth.at(x, y) = static_cast<float>(depth);
            image.at(x, y) = colour(x, y);
        }
    }
    v.nearPlane = 0.01;
    v.farPlane = 1000;
    v.texture = std::move(image);
    return v;
}

const auto kGrey = [](int, int) { return glm::u8vec4(90, 140, 200, 255); };

Camera cameraAt(glm::dvec3 eye, glm::dvec3 target, int size, double fovRad,
                bool orthographic = false) {
    return Camera::fromFieldOfView(eye, *lookAt(eye, target), glm::dvec2(fovRad), orthographic,
                                   size, size);
}

RenderSettings splatSettings(SplatRule rule = SplatRule::data) {
    RenderSettings s;
    s.mode = RenderMode::splat;
    s.splat = rule;
    return s;
}

Frame drawn(const Bundle& bundle, const Camera& camera, const RenderSettings& settings) {
    Job job;
    auto frame = makeCpuSplatRenderer(bundle, settings, job)->render(camera);
    EXPECT_TRUE(frame) << frame.error().text();
    return frame ? *std::move(frame) : Frame{};
}

std::int64_t emptyPixels(const Frame& frame) {
    std::int64_t n = 0;
    for (std::size_t i = 0; i < frame.depth.count(); ++i)
        n += !hasPoint(frame.depth.pixels()[i]) || !(frame.colour.pixels()[i].a > 0);
    return n;
}

// Straight colours of a frame, for comparing with pictures.
Image<glm::vec4> straight(const Frame& f) {
    Image<glm::vec4> out = f.colour;
    for (auto& c : out.pixels())
        if (c.a > 0) c = glm::vec4(glm::vec3(c) / c.a, c.a);
    return out;
}

Image<glm::vec4> floats(const Texture& t) {
    Image<glm::vec4> out(t.width(), t.height());
    for (int y = 0; y < t.height(); ++y)
        for (int x = 0; x < t.width(); ++x) out.at(x, y) = t.at(x, y);
    return out;
}

TEST(CpuSplat, TiltedPlanesHaveNoPinholesAtAnyZoom) {
    for (const bool sourceOrthographic : {false, true}) {
        Bundle bundle;
        const double extent = sourceOrthographic ? 4.0 : 1.2;
        bundle.views.push_back(planeView(
            cameraAt({0.1, 0, 0}, {0, 0, -3}, 128, extent, sourceOrthographic), 3.0, 0.9, kGrey));
        for (const bool orthographic : {false, true}) {
            for (const double zoom : {0.3, 0.7, 1.0, 1.37, 2.0, 3.0, 5.0, 8.0}) {
                // Looks at the middle of the plane from the side, a little rolled.
                Camera c = cameraAt({-0.7, 0.4, 0.3}, {0, 0, -3}, 160, (orthographic ? 1.2 : 0.36),
                                    orthographic);
                c.orientation = c.orientation * quatFromAxisAngle({0, 0, 1, 0.3});
                c.fx *= zoom > 1 ? zoom : 1;
                c.fy *= zoom > 1 ? zoom : 1;
                if (zoom < 1)
                    c = c.resized(static_cast<int>(160 * zoom), static_cast<int>(160 * zoom));
                const Frame f = drawn(bundle, c, splatSettings());
                EXPECT_EQ(emptyPixels(f), 0)
                    << "zoom " << zoom << (orthographic ? " orthographic" : "");
                float worst = 0, worstDepth = 0;
                for (int y = 0; y < c.height; ++y) {
                    for (int x = 0; x < c.width; ++x) {
                        const glm::vec4 d =
                            glm::abs(f.colour.at(x, y) - glm::vec4(90, 140, 200, 255) / 255.0f);
                        worst = std::max({worst, d.r, d.g, d.b, d.a});
                        const glm::dvec3 p =
                            c.position +
                            c.orientation * c.unproject(x + 0.5, y + 0.5, f.depth.at(x, y));
                        worstDepth =
                            std::max(worstDepth, static_cast<float>(std::abs(p.z + 3 - 0.9 * p.x)));
                    }
                }
                EXPECT_LT(worst, 1e-3f) << "zoom " << zoom;
                EXPECT_LT(worstDepth, 0.02f)
                    << "zoom " << zoom << (orthographic ? " orthographic" : "")
                    << (sourceOrthographic ? " from orthographic" : "");
            }
        }
    }
}

TEST(CpuSplat, BlendedSplatsBeatPointsInARoom) {
    const Bundle bundle = analyticBundle(AnalyticScene::room, 4);
    Camera camera = analyticCamera(AnalyticScene::room, 1.5, 4);
    camera.position += camera.forward();
    const ReferenceView truth = viewOfAnalyticScene(AnalyticScene::room, camera);
    const auto data =
        compare(straight(drawn(bundle, camera, splatSettings())), floats(truth.texture));
    const auto point = compare(straight(drawn(bundle, camera, splatSettings(SplatRule::point))),
                               floats(truth.texture));
    ASSERT_TRUE(data && point);
    RecordProperty("dataY", std::to_string(*data->psnrY));
    RecordProperty("pointY", std::to_string(*point->psnrY));
    EXPECT_GT(*data->psnrY, 34.0);
    EXPECT_GT(*data->psnrY, *point->psnrY + 4.0);
    // The nearest surface is drawn: depths agree where a splat is not at an edge.
    const Frame f = drawn(bundle, camera, splatSettings());
    std::int64_t wrong = 0;
    for (std::size_t i = 0; i < f.depth.count(); ++i)
        wrong += !(std::abs(f.depth.pixels()[i] / truth.depth.pixels()[i] - 1.0f) < 0.01f);
    EXPECT_LT(wrong, static_cast<std::int64_t>(f.depth.count()) / 40);
}

TEST(CpuSplat, ASilhouetteKeepsItsCoverage) {
    const Bundle bundle = analyticBundle(AnalyticScene::object, 9, 4);
    const Camera camera = analyticCamera(AnalyticScene::object, 3.5, 9);
    const ReferenceView truth = viewOfAnalyticScene(AnalyticScene::object, camera, 4);
    const Frame f = drawn(bundle, camera, splatSettings());
    double sum = 0, expected = 0, partly = 0;
    for (int y = 0; y < camera.height; ++y) {
        for (int x = 0; x < camera.width; ++x) {
            const float a = f.colour.at(x, y).a;
            ASSERT_GE(a, 0.0f);
            ASSERT_LE(a, 1.0f);
            sum += a;
            expected += truth.texture.at(x, y).a;
            partly += a > 0.1f && a < 0.9f;
        }
    }
    EXPECT_NEAR(sum / expected, 1.0, 0.04);
    EXPECT_GT(partly, 50) << "edges must be anti-aliased";
    // No background colour creeps in: straight colours stay those of the object.
    EXPECT_GT(*compare(straight(f), floats(truth.texture))->psnrY, 24.0);
}

TEST(CpuSplat, TheFrontHidesTheBack) {
    Bundle bundle;
    const auto red = [](int, int) { return glm::u8vec4(255, 0, 0, 255); };
    const auto blue = [](int, int) { return glm::u8vec4(0, 0, 255, 255); };
    bundle.views.push_back(planeView(cameraAt({0, 0, 0}, {0, 0, -1}, 96, 1.0), 6.0, 0.0, blue));
    bundle.views.push_back(planeView(cameraAt({0, 0, 0}, {0, 0, -1}, 96, 1.0), 3.0, 0.0, red));
    for (const auto rule : {SplatRule::data, SplatRule::paper, SplatRule::point}) {
        const Frame f =
            drawn(bundle, cameraAt({0.2, 0.1, -1}, {0, 0, -3}, 64, 0.5), splatSettings(rule));
        std::int64_t blues = 0;
        for (const auto& c : f.colour.pixels()) blues += c.b > 0;
        // One-pixel points leave gaps when the camera comes closer; splats do not.
        if (rule == SplatRule::point)
            EXPECT_GT(blues, 0);
        else
            EXPECT_EQ(blues, 0);
    }
}

/// From far away 1 % of the distance is more than the scene is deep: the plane behind was blended
/// in. A blue plane, as large as all that its view sees of it, and half as far a red one.
TEST(CpuSplat, TheFrontHidesTheBackFromFarAway) {
    Bundle bundle;
    const Camera view = cameraAt({0, 0, 0}, {0, 0, -1}, 96, 1.0);
    for (const double distance : {6.0, 3.0})
        bundle.views.push_back(planeView(view, distance, 0.0, [&](int, int) {
            return distance > 3 ? glm::u8vec4(0, 0, 255, 255) : glm::u8vec4(255, 0, 0, 255);
        }));
    for (const bool orthographic : {false, true}) {
        for (const double eye : {1.0, 300.0, 1e3, 1e5}) {
            const double window = orthographic ? 2.0 : 2 * std::atan(1 / (eye + 3));
            const Camera camera = cameraAt({0, 0, eye}, {0, 0, -3}, 64, window, orthographic);
            const Frame frame = drawn(bundle, camera, splatSettings());
            EXPECT_EQ(emptyPixels(frame), 0);
            for (const glm::vec4& c : frame.colour.pixels())
                ASSERT_EQ(c.b, 0) << eye << (orthographic ? " orthographic" : "");
        }
    }
}

// What share of the quarters of each view's blocks a picture needs.
std::vector<double> neededOf(const Bundle& bundle, const Camera& novel) {
    const PageSet set(bundle);
    splat::PreparedPages prepared = splat::preparePages(set, false);
    splat::findOthers(set, prepared);
    std::vector<double> out;
    for (const splat::PreparedRectangle& r : prepared.rectangles) {
        splat::RectangleImages source;
        source.fx = static_cast<float>(r.camera().fx);
        source.fy = static_cast<float>(r.camera().fy);
        source.map = pixelMap(r.camera(), novel);
        const ShareLength shares(novel, prepared.radius);
        int needed = 0;
        for (const splat::BlockInfo& block : r.blocks) {
            splat::BlockTask task;
            if (!splat::planBlock(r, block, source, novel, shares, true, task)) continue;
            splat::forNeeded(
                task, [&](int u0, int v0, int u1, int v1) { needed += (u1 - u0) * (v1 - v0); });
        }
        out.push_back(needed / (256.0 * static_cast<double>(r.blocks.size())));
    }
    return out;
}

// Two views see a plane, 70 degrees apart.
TEST(CpuSplat, LeavesOutWhatAnotherViewShowsBetter) {
    const auto of = [](const Camera& camera) { return planeView(camera, 2.0, 0.0, kGrey); };
    Bundle bundle;
    bundle.views.push_back(of(cameraAt({0, 0, 0}, {0, 0, -2}, 128, 0.9)));
    bundle.views.push_back(of(cameraAt({5.5, 0, 0}, {0, 0, -2}, 128, 0.3)));
    const auto alone = [&](std::size_t k, const Camera& novel) {
        Bundle one;
        one.views.push_back(bundle.views[k]);
        return neededOf(one, novel)[0];
    };
    const Camera nearFirst = cameraAt({0.1, 0, 0.05}, {0, 0, -2}, 200, 0.4);
    const auto first = neededOf(bundle, nearFirst);
    EXPECT_EQ(first[0], alone(0, nearFirst));
    EXPECT_LT(first[1], 0.25 * alone(1, nearFirst));
    // From between them both are needed.
    const Camera between = cameraAt({1.4, 0, 0}, {0, 0, -2}, 200, 0.4);
    const auto both = neededOf(bundle, between);
    for (std::size_t k = 0; k < 2; ++k) EXPECT_EQ(both[k], alone(k, between)) << k;
    // The second sees the plane so steeply that its splats alone could leave gaps.
    const Camera nearSecond = cameraAt({5.4, 0, 0.05}, {0, 0, -2}, 200, 0.4);
    EXPECT_EQ(neededOf(bundle, nearSecond)[0], alone(0, nearSecond));
    // What the first does not show is drawn from the second.
    for (const int size : {8, 20}) {
        for (int y = 60; y < 60 + size; ++y)
            for (int x = 60; x < 60 + size; ++x) bundle.views[0].depth.at(x, y) = kNoDepth;
        EXPECT_GT(neededOf(bundle, nearFirst)[1], first[1]) << size;
        const Frame frame = drawn(bundle, nearFirst, splatSettings());
        for (const auto& c : frame.colour.pixels()) ASSERT_FLOAT_EQ(c.a, 1.0f) << size;
    }
}

TEST(CpuSplat, ThreadsDoNotChangeAByte) {
    const Bundle bundle = analyticBundle(AnalyticScene::object, 9, 2);
    const Camera camera = analyticCamera(AnalyticScene::object, 2.3, 9).resized(400, 300);
    for (const auto rule : {SplatRule::data, SplatRule::paper, SplatRule::point}) {
        auto settings = splatSettings(rule);
        settings.lighting.lights.push_back(
            {Light::Kind::directional, {0, -1, -1}, {1, 1, 1}, false});
        const auto with = [&](int threads) {
            const ThreadLimit limit(threads);
            return drawn(bundle, camera, settings);
        };
        const Frame one = with(1);
        for (const int threads : {2, 3, 8}) {
            const Frame many = with(threads);
            EXPECT_TRUE(one.colour == many.colour);
            EXPECT_TRUE(one.depth == many.depth);
            EXPECT_TRUE(one.normal == many.normal);
            EXPECT_TRUE(one.albedo == many.albedo);
        }
    }
}

// Pictures are drawn in parts, splats as several patches: where those end must not show.
TEST(CpuSplat, WhatIsDrawnAtOnceDoesNotShow) {
    for (const int side : {128, 800}) {
        SCOPED_TRACE(side == 128 ? "large splats" : "small splats");
        Bundle bundle;
        bundle.views.push_back(
            planeView(cameraAt({0, 0, 0}, {0, 0, -1}, side, 0.9), 2.0, 0.7, [&](int x, int y) {
                return glm::u8vec4(x * 255 / side, y * 255 / side, (x * 7 + y * 3) % 256,
                                   x < side / 2 ? 255 : 200);
            }));
        Camera whole = cameraAt({0.3, 0.2, 0.9}, {0, 0, -2}, 600, 1.2);
        whole = whole.resized(620, 300);
        Camera moved = whole;
        constexpr int kX = 101, kY = 53;
        moved.cx -= kX;
        moved.cy -= kY;
        moved.width -= kX;
        moved.height -= kY;
        const Frame a = drawn(bundle, whole, splatSettings());
        const Frame b = drawn(bundle, moved, splatSettings());
        double worst = 0;
        std::int64_t covered = 0, other = 0;
        for (int y = 3; y + 3 < moved.height; ++y) {
            for (int x = 3; x + 3 < moved.width; ++x) {
                const glm::vec4 d = a.colour.at(x + kX, y + kY) - b.colour.at(x, y);
                worst = std::max({worst, std::abs(double{d.x}), std::abs(double{d.y}),
                                  std::abs(double{d.z}), std::abs(double{d.w})});
                covered += b.colour.at(x, y).a > 0;
                other += hasPoint(a.depth.at(x + kX, y + kY)) != hasPoint(b.depth.at(x, y));
            }
        }
        EXPECT_GT(covered, 30000);
        EXPECT_EQ(other, 0);
        EXPECT_LT(worst, 2e-3);
    }
}

TEST(CpuSplat, AFrameGivenBackLeavesNothingInTheNext) {
    Bundle bundle;
    bundle.views.push_back(planeView(cameraAt({0, 0, 0}, {0, 0, -1}, 96, 0.5), 3.0, 0.2, kGrey));
    const Camera near = cameraAt({0, 0, -1}, {0, 0, -3}, 400, 0.7);
    const Camera far = cameraAt({1, 0.5, 6}, {0, 0, -3}, 400, 0.7);
    for (const auto rule : {SplatRule::data, SplatRule::point}) {
        RenderSettings settings = splatSettings(rule);
        settings.normals = true;
        Job job;
        const auto renderer = makeCpuSplatRenderer(bundle, settings, job);
        const Frame alone = drawn(bundle, far, settings);
        auto first = renderer->render(near);
        ASSERT_TRUE(first);
        renderer->reuse(*std::move(first));
        const auto second = renderer->render(far);
        ASSERT_TRUE(second);
        EXPECT_TRUE(second->colour == alone.colour && second->depth == alone.depth);
        EXPECT_TRUE(second->albedo == alone.albedo && second->normal == alone.normal);
    }
}

TEST(CpuSplat, EverySimdTargetDrawsTheSame) {
    const Bundle bundle = analyticBundle(AnalyticScene::object, 4, 2);
    const Camera camera = analyticCamera(AnalyticScene::object, 0.6, 4).resized(331, 203);
    for (const auto rule : {SplatRule::data, SplatRule::paper, SplatRule::point}) {
        auto settings = splatSettings(rule);
        settings.lighting.lights.push_back({});
        const Frame best = drawn(bundle, camera, settings);
        int targets = 0;
        for (const auto target : hwy::SupportedAndGeneratedTargets()) {
            hwy::SetSupportedTargetsForTest(target);
            hwy::GetChosenTarget().DeInit();
            Job job;
            auto renderer = makeCpuSplatRenderer(bundle, settings, job);
            const auto f = renderer->render(camera);
            hwy::SetSupportedTargetsForTest(0);
            hwy::GetChosenTarget().DeInit();
            ASSERT_TRUE(f);
            ++targets;
            const auto c = compare(f->colour, best.colour);
            ASSERT_TRUE(c);
            // Fused multiply-add rounds otherwise, which moves a point over a pixel's border at
            // times.
            EXPECT_GT(c->psnrRgb.value_or(99.0), 50.0) << hwy::TargetName(target);
        }
        EXPECT_GT(targets, 0);
    }
}

TEST(CpuSplat, ACameraThatSeesNothingGivesAnEmptyFrame) {
    Bundle bundle;
    bundle.views.push_back(planeView(cameraAt({0, 0, 0}, {0, 0, -1}, 64, 1.0), 3.0, 0.0, kGrey));
    for (const auto rule : {SplatRule::data, SplatRule::paper, SplatRule::point}) {
        const Frame away =
            drawn(bundle, cameraAt({0, 0, 0}, {0, 0, 1}, 50, 1.0), splatSettings(rule));
        EXPECT_EQ(emptyPixels(away), 50 * 50);
        for (const auto& c : away.colour.pixels()) EXPECT_EQ(c, glm::vec4(0.0f));
    }
    // From behind, the splats that follow the data face away.
    EXPECT_EQ(
        emptyPixels(drawn(bundle, cameraAt({0, 0, -6}, {0, 0, -3}, 50, 0.5), splatSettings())),
        50 * 50);
    // A view without a point.
    bundle.views[0].depth = Image<float>(64, 64, kNoDepth);
    EXPECT_EQ(emptyPixels(drawn(bundle, cameraAt({0, 0, 0}, {0, 0, -1}, 50, 1.0), splatSettings())),
              50 * 50);
}

TEST(CpuSplat, ACameraInsideTheObjectGivesFiniteColours) {
    const Bundle bundle = analyticBundle(AnalyticScene::object, 9);
    for (const glm::dvec3 eye :
         {glm::dvec3(0.62, 0, 0), glm::dvec3(0.62, 0.21, 0.01), glm::dvec3(0, 0, 0)}) {
        for (const auto rule : {SplatRule::data, SplatRule::paper, SplatRule::point}) {
            const Frame f =
                drawn(bundle, cameraAt(eye, {0, 0.1, -2}, 96, 1.5), splatSettings(rule));
            for (const auto& c : f.colour.pixels()) {
                ASSERT_TRUE(std::isfinite(c.r + c.g + c.b + c.a));
                ASSERT_LE(c.a, 1.0f);
            }
        }
    }
}

TEST(CpuSplat, ScalesFromMicronsToLightYears) {
    for (const double scale : {1e-6, 1.0, 1e9}) {
        Bundle bundle;
        ReferenceView v = planeView(cameraAt({0, 0, 0}, {0, 0, -1}, 100, 1.0), 3.0, 0.4, kGrey);
        for (auto& d : v.depth.pixels()) d *= static_cast<float>(scale);
        v.nearPlane *= scale;
        v.farPlane *= scale;
        bundle.views.push_back(std::move(v));
        Camera c = cameraAt({0.1, 0.1, 0}, {0, 0, -3}, 80, 0.6);
        c.position *= scale;
        const Frame f = drawn(bundle, c, splatSettings());
        EXPECT_EQ(emptyPixels(f), 0) << scale;
        EXPECT_NEAR(f.depth.at(40, 40) / scale, 3.0, 0.1);
    }
}

TEST(CpuSplat, PointsFromTheirOwnPoseComeBackExactly) {
    const Bundle bundle = analyticBundle(AnalyticScene::object, 1);
    const auto& v = bundle.views[0];
    const Frame f = drawn(bundle, v.camera, splatSettings(SplatRule::point));
    for (int y = 0; y < f.depth.height(); ++y) {
        for (int x = 0; x < f.depth.width(); ++x) {
            if (!hasPoint(v.depth.at(x, y)) || !(v.texture.at(x, y).a > 0)) {
                ASSERT_FALSE(hasPoint(f.depth.at(x, y)));
                continue;
            }
            ASSERT_NEAR(f.depth.at(x, y), v.depth.at(x, y), 1e-5f);
            ASSERT_EQ(glm::u8vec4(f.colour.at(x, y) * 255.0f + 0.5f), v.texture.rgba8()->at(x, y));
        }
    }
    // Blended splats give back what they were made of, nearly.
    const auto c = compare(straight(drawn(bundle, v.camera, splatSettings())), floats(v.texture));
    EXPECT_GT(*c->psnrY, 35.0);
}

TEST(CpuSplat, ThePapersRuleIsACoefficientOverTheDistance) {
    // One point at distance 2 with coefficient 40: a disc of diameter 20 pixels.
    Bundle bundle;
    ReferenceView v = planeView(cameraAt({0, 0, 0}, {0, 0, -1}, 33, 1.0), 2.0, 0.0, kGrey);
    for (int y = 0; y < 33; ++y)
        for (int x = 0; x < 33; ++x)
            if (x != 16 || y != 16) v.depth.at(x, y) = kNoDepth;
    bundle.views.push_back(std::move(v));
    auto settings = splatSettings(SplatRule::paper);
    settings.splatCoefficient = 40;
    const Frame f = drawn(bundle, cameraAt({0, 0, 0}, {0, 0, -1}, 101, 1.0), settings);
    std::int64_t covered = 0;
    for (const float d : f.depth.pixels()) covered += hasPoint(d);
    EXPECT_NEAR(static_cast<double>(covered), 3.14159 * 10 * 10, 12.0);
    EXPECT_TRUE(hasPoint(f.depth.at(50, 50)));
}

TEST(CpuSplat, SplatAxesOfTheFileDecideTheSize) {
    const auto coveredWith = [](float half) {
        Bundle bundle;
        ReferenceView v = planeView(cameraAt({0, 0, 0}, {0, 0, -1}, 65, 0.5), 2.0, 0.0, kGrey);
        v.splatU = v.splatV = Image<glm::vec3>(65, 65);
        for (int y = 0; y < 65; ++y) {
            for (int x = 0; x < 65; ++x) {
                if (x != 32 || y != 32) v.depth.at(x, y) = kNoDepth;
                v.splatU.at(x, y) = {half, 0, 0};
                v.splatV.at(x, y) = {0, half, 0};
            }
        }
        bundle.views.push_back(std::move(v));
        const Frame f = drawn(bundle, cameraAt({0, 0, 0}, {0, 0, -1}, 1001, 0.5), splatSettings());
        std::int64_t n = 0;
        for (const float d : f.depth.pixels()) n += hasPoint(d);
        return static_cast<double>(n);
    };
    const auto spacing = static_cast<float>(2.0 * 2.0 * std::tan(0.25) / 65);
    EXPECT_NEAR(coveredWith(1.4f * spacing) / coveredWith(0.7f * spacing), 4.0, 0.4);
}

TEST(CpuSplat, LightFallsOnTheNormals) {
    Bundle bundle;
    bundle.views.push_back(planeView(cameraAt({0, 0, 0}, {0, 0, -1}, 100, 1.0), 3.0, 0.5, kGrey));
    auto settings = splatSettings();
    settings.lighting.ambient = glm::vec3(0.1f);
    settings.lighting.lights.push_back({Light::Kind::directional, {0, 0, -1}, {1, 1, 1}, false});
    for (const auto rule : {SplatRule::data, SplatRule::point}) {
        settings.splat = rule;
        const Frame f = drawn(bundle, cameraAt({0, 0, 0}, {0, 0, -1}, 100, 1.0), settings);
        const glm::vec3 normal = glm::normalize(glm::vec3(-0.5f, 0, 1));
        EXPECT_LT(glm::distance(f.normal.at(50, 50), normal), 0.02f);
        const glm::vec3 expected = glm::vec3(90, 140, 200) / 255.0f * (0.1f + normal.z);
        EXPECT_LT(glm::distance(glm::vec3(f.colour.at(50, 50)), expected), 0.01f);
        EXPECT_LT(glm::distance(glm::vec3(f.albedo.at(50, 50)), glm::vec3(90, 140, 200) / 255.0f),
                  0.01f);
    }
    settings.lighting.lights.clear();
    EXPECT_TRUE(drawn(bundle, bundle.views[0].camera, settings).albedo.empty());
}

TEST(CpuSplat, LinearTexturesStayLinear) {
    Bundle bundle;
    ReferenceView v = planeView(cameraAt({0, 0, 0}, {0, 0, -1}, 40, 1.0), 3.0, 0.2, kGrey);
    v.texture = RgbaFloatImage(40, 40, {3.0f, 0.5f, 0.01f, 1.0f});
    bundle.views.push_back(std::move(v));
    for (const auto rule : {SplatRule::data, SplatRule::paper, SplatRule::point}) {
        const Frame f = drawn(bundle, bundle.views[0].camera, splatSettings(rule));
        EXPECT_TRUE(f.linear);
        EXPECT_LT(glm::distance(f.colour.at(20, 20), glm::vec4(3.0f, 0.5f, 0.01f, 1.0f)), 1e-3f);
    }
}

TEST(CpuSplat, RefusesCamerasAndFramesThatMakeNoSense) {
    Bundle bundle;
    bundle.views.push_back(planeView(cameraAt({0, 0, 0}, {0, 0, -1}, 40, 1.0), 3.0, 0.2, kGrey));
    Job job;
    const auto renderer = makeCpuSplatRenderer(bundle, splatSettings(), job);
    Camera c = cameraAt({0, 0, 0}, {0, 0, -1}, 40, 0.5);
    EXPECT_TRUE(renderer->render(c));
    Camera bad = c;
    bad.position.x = std::numeric_limits<double>::quiet_NaN();
    EXPECT_FALSE(renderer->render(bad));
    bad = c;
    bad.width = 0;
    EXPECT_FALSE(renderer->render(bad));
    bad = c.resized(100000, 100000);
    const auto huge = renderer->render(bad);
    ASSERT_FALSE(huge);
    EXPECT_NE(huge.error().message.find("frame"), std::string::npos);
}

/// A plane that a view sees at 86 degrees. Its steps were taken for ends of surfaces, its splats
/// had no tilt, and from above it was a lattice of holes.
TEST(Splats, CoverWhatIsSeenEdgeOn) {
    for (const bool orthographic : {false, true}) {
        Bundle bundle;
        bundle.views = {
            planeView(cameraAt({0, 0, 0}, {0, 0, -1}, 64, orthographic ? 1.0 : 0.25, orthographic),
                      5, 14, kGrey)};
        if (!orthographic) bundle.views[0].depthBits = 16;
        const PageSet set(bundle);
        const splat::PreparedPages prepared = splat::preparePages(set, false);
        int linked = 0, tilted = 0, points = 0;
        for (int y = 1; y < 63; ++y) {
            for (int x = 4; x < 60; ++x) {
                if (!hasPoint(bundle.views[0].depth.at(x - 4, y)) ||
                    !hasPoint(bundle.views[0].depth.at(x + 4, y)))
                    continue;
                const splat::Slope s = prepared.pages[0].slopes.data()[64 * y + x];
                ++points;
                linked += s.u & splat::Slope::kLinked;
                tilted += std::abs(s.u) > 5 * splat::kSlopeScale;
            }
        }
        EXPECT_GT(points, 500);
        EXPECT_EQ(linked, points) << (orthographic ? "orthographic" : "perspective");
        EXPECT_EQ(tilted, points);
    }
}

/// What jumps once, or by way of a pixel between, is two surfaces.
TEST(Splats, AreNotTiltedAcrossJumps) {
    const Camera camera = cameraAt({0, 0, 0}, {0, 0, -1}, 64, 0.5);
    Bundle bundle;
    bundle.views = {planeView(camera, 5, 0, kGrey)};
    Image<float>& depth = bundle.views[0].depth;
    for (int y = 0; y < 64; ++y) {
        for (int x = 0; x < 64; ++x)
            if (x > 32) depth.at(x, y) = 7;
        if (y > 32) depth.at(32, y) = 1 / (0.5f * (1 / 5.0f + 1 / 7.0f));
    }
    const PageSet set(bundle);
    const splat::PreparedPages prepared = splat::preparePages(set, false);
    for (int y = 1; y < 63; ++y) {
        for (int x = 30; x < 36; ++x) {
            const splat::Slope s = prepared.pages[0].slopes.data()[64 * y + x];
            EXPECT_EQ(s.u & ~1, 0) << x << ", " << y;
        }
        EXPECT_FALSE(prepared.pages[0].slopes.data()[64 * y + 33].u & splat::Slope::kLinked);
    }
}

}  // namespace
}  // namespace stx
