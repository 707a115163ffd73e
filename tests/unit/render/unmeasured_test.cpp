// What captured views show without a depth: drawn where nothing else is, and nowhere else.

#include "lib/refine/unmeasured.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "lib/packing/prune.hpp"
#include "lib/render/api/stage_log.hpp"
#include "lib/render/bench/analytic_scene.hpp"
#include "lib/render/factory.hpp"

namespace stx {
namespace {

constexpr int kWide = 160, kHigh = 120;
/// The wall is in the plane z = 0.
constexpr double kEye = 4.0;
/// Scene units on both sides of x = 0 and y = 0: the window of the wall.
constexpr double kWindow = 0.6;

Camera wallCamera(double x) {
    Camera camera;
    camera.width = kWide;
    camera.height = kHigh;
    camera.fx = camera.fy = 150;
    camera.cx = 0.5 * kWide;
    camera.cy = 0.5 * kHigh;
    camera.position = {x, 0, kEye};
    return camera;
}

double wave(double a, double b) {
    return 0.5 + 0.25 * std::sin(a) * std::cos(b) + 0.2 * std::sin(0.37 * a + 1.3 * b);
}

/// A wall with a window, behind which is a sky at infinity without a depth.
ReferenceView wallWithWindow(const Camera& camera, NoDepth noDepth) {
    ReferenceView view;
    view.name = "x" + std::to_string(camera.position.x);
    view.camera = camera;
    view.nearPlane = 0.9 * kEye;
    view.farPlane = 1.1 * kEye;
    view.depthBits = 32;
    view.noDepth = noDepth;
    Rgba8Image colours(kWide, kHigh);
    view.depth = Image<float>(kWide, kHigh, kNoDepth);
    for (int y = 0; y < kHigh; ++y) {
        for (int x = 0; x < kWide; ++x) {
            const glm::dvec3 ray = camera.unproject(x + 0.5, y + 0.5, 1.0);
            const glm::dvec3 at = camera.position + kEye * ray;
            const bool sky = std::abs(at.x) < kWindow && std::abs(at.y) < kWindow;
            if (!sky) view.depth.at(x, y) = static_cast<float>(kEye);
            const double light = sky ? wave(40 * ray.x, 40 * ray.y) : wave(9 * at.x, 9 * at.y);
            const auto byte = static_cast<std::uint8_t>(255 * light);
            colours.at(x, y) = sky ? glm::u8vec4(byte / 4, byte / 2, byte, 255)
                                   : glm::u8vec4(byte, byte, byte / 3, 255);
        }
    }
    view.texture = std::move(colours);
    return view;
}

Bundle walls(NoDepth noDepth = NoDepth::unknown) {
    Bundle bundle;
    for (const double x : {-0.3, -0.1, 0.1, 0.3})
        bundle.views.push_back(wallWithWindow(wallCamera(x), noDepth));
    return bundle;
}

Frame drawn(const Bundle& bundle, const Camera& camera, const RenderSettings& settings) {
    Job job;
    const auto renderer = makeRenderer(Backend::cpu, bundle, settings, -1, job);
    EXPECT_TRUE(renderer);
    auto frame = (*renderer)->render(camera);
    EXPECT_TRUE(frame);
    return std::move(*frame);
}

Frame drawn(const Bundle& bundle, const Camera& camera, RenderMode mode, bool unmeasured) {
    RenderSettings settings;
    settings.mode = mode;
    if (!unmeasured) settings.without.add(Stage::unmeasured);
    return drawn(bundle, camera, settings);
}

/// dB over R, G and B of pixels.
template <class Wanted>
double psnrOf(const Frame& frame, const ReferenceView& truth, const Wanted& wanted) {
    double error = 0;
    int count = 0;
    for (std::size_t i = 0; i < frame.colour.count(); ++i) {
        if (!wanted(i)) continue;
        const glm::vec3 d = glm::vec3(frame.colour.data()[i]) - glm::vec3(truth.texture.at(i));
        error += glm::dot(d, d) / 3;
        ++count;
    }
    return -10 * std::log10(std::max(error / count, 1e-10));
}

UnmeasuredDepth foundIn(const Bundle& bundle) {
    std::vector<RefineView> views;
    for (const ReferenceView& v : bundle.views) views.push_back({&v, &v.texture, &v.depth});
    return unmeasuredDepth(views, std::vector<bool>(views.size(), true));
}

TEST(Unmeasured, ASkyIsFarAway) {
    const UnmeasuredDepth found = foundIn(walls());
    EXPECT_GT(found.farAway, 100 * kEye);
    EXPECT_GT(static_cast<double>(found.far), 0.97 * static_cast<double>(found.far + found.placed));
}

TEST(Unmeasured, WhatLiesOnTheWallIsFoundThere) {
    Bundle bundle;
    for (const double x : {-0.3, -0.1, 0.1, 0.3}) {
        ReferenceView view = wallWithWindow(wallCamera(x), NoDepth::unknown);
        // As where a depth camera sees less than the colour camera.
        for (int y = 0; y < kHigh; ++y)
            for (int i = 0; i < 20; ++i) view.depth.at(i, y) = kNoDepth;
        bundle.views.push_back(std::move(view));
    }
    const UnmeasuredDepth found = foundIn(bundle);
    for (const Image<float>& depth : found.depth) {
        int off = 0;
        for (int y = 0; y < kHigh; ++y)
            for (int i = 0; i < 20; ++i) off += std::abs(depth.at(i, y) - kEye) > 0.02 * kEye;
        EXPECT_LT(off, 20 * kHigh / 50);
    }
}

TEST(Unmeasured, WithoutOtherViewsColoursTellWhatGoesOn) {
    Bundle bundle;
    bundle.views.push_back(wallWithWindow(wallCamera(0), NoDepth::unknown));
    ReferenceView& view = bundle.views[0];
    for (std::size_t i = 0; i < view.depth.count(); ++i)
        if (!hasPoint(view.depth.data()[i])) view.texture.rgba8()->data()[i] = {0, 40, 255, 255};
    const UnmeasuredDepth found = foundIn(bundle);
    EXPECT_GT(static_cast<double>(found.far), 0.8 * static_cast<double>(found.far + found.placed));
}

TEST(Unmeasured, ASkyIsDrawnThroughTheWindow) {
    const Camera camera = wallCamera(0.04);
    const ReferenceView truth = wallWithWindow(camera, NoDepth::unknown);
    const auto sky = [&](std::size_t i) { return !hasPoint(truth.depth.data()[i]); };
    for (const RenderMode mode : {RenderMode::surface, RenderMode::splat}) {
        const Frame with = drawn(walls(), camera, mode, true),
                    without = drawn(walls(), camera, mode, false);
        EXPECT_GT(psnrOf(with, truth, sky), 30.0);
        EXPECT_GT(psnrOf(with, truth, sky), psnrOf(without, truth, sky) + 6);
        int withDepth = 0, count = 0;
        for (std::size_t i = 0; i < with.depth.count(); ++i) {
            if (hasPoint(with.depth.data()[i])) {
                EXPECT_LT(with.depth.data()[i], 1.05 * kEye) << "nothing is known behind the wall";
            }
            if (!sky(i)) continue;
            ++count;
            withDepth += hasPoint(with.depth.data()[i]);
        }
        EXPECT_LT(withDepth, count / 5);
    }
}

TEST(Unmeasured, WhatIsDrawnBehindIsToldALog) {
    RenderSettings settings;
    settings.log = std::make_shared<StageLog>();
    Job job;
    const auto renderer = makeRenderer(Backend::cpu, walls(), settings, -1, job);
    ASSERT_TRUE(renderer);
    ASSERT_TRUE((*renderer)->render(wallCamera(0.04)));
    EXPECT_TRUE(std::ranges::any_of(settings.log->entries(), [](const StageLog::Entry& e) {
        return e.name == "behind" && !e.once;
    }));
}

TEST(Unmeasured, ASkyIsDrawnOfPrunedViews) {
    const Camera camera = wallCamera(0.04);
    const ReferenceView truth = wallWithWindow(camera, NoDepth::unknown);
    const auto sky = [&](std::size_t i) { return !hasPoint(truth.depth.data()[i]); };
    const auto all = [](std::size_t) { return true; };
    Bundle pruned = walls();
    Job job;
    const auto report = prune(pruned, {}, job);
    ASSERT_TRUE(report) << report.error().text();
    ASSERT_LT(report->keptPixels, report->sourcePixels / 2);
    for (const RenderMode mode : {RenderMode::surface, RenderMode::splat}) {
        const Frame whole = drawn(walls(), camera, mode, true),
                    frame = drawn(pruned, camera, mode, true);
        EXPECT_GT(psnrOf(frame, truth, sky), psnrOf(whole, truth, sky) - 3.5);
        EXPECT_GT(psnrOf(frame, truth, all), psnrOf(whole, truth, all) - 3.5);
    }
}

TEST(Unmeasured, TakesNothingFromWhatIsMeasured) {
    // One view has no depth at all of a part of the wall that the others show.
    Bundle bundle = walls();
    for (int y = 0; y < kHigh; ++y)
        for (int x = 100; x < kWide; ++x) bundle.views[1].depth.at(x, y) = kNoDepth;
    const Camera camera = wallCamera(-0.08);
    const ReferenceView truth = wallWithWindow(camera, NoDepth::unknown);
    for (const RenderMode mode : {RenderMode::surface, RenderMode::splat}) {
        const Frame with = drawn(bundle, camera, mode, true),
                    without = drawn(bundle, camera, mode, false);
        for (std::size_t i = 0; i < with.colour.count(); ++i) {
            if (without.colour.data()[i].a < 1.0f || !hasPoint(truth.depth.data()[i])) continue;
            const glm::vec4 d = glm::abs(with.colour.data()[i] - without.colour.data()[i]);
            // Beside the window pixels are filled, or mixtures with what is behind.
            const int x = static_cast<int>(i) % kWide, y = static_cast<int>(i) / kWide;
            const glm::dvec3 at = camera.position + kEye * camera.unproject(x + 0.5, y + 0.5, 1.0);
            if (std::max(std::abs(at.x), std::abs(at.y)) < kWindow + 0.06) continue;
            ASSERT_LT(std::max({d.x, d.y, d.z}), 1e-6f) << x << ", " << y;
        }
    }
}

/// A view's own pose, too: its holes shone, while the wall around them lay in the dark.
TEST(Unmeasured, HolesInAWallAreLitAsTheWallIs) {
    constexpr int kHole = 8, kAt = 10;
    Bundle bundle = walls();
    for (ReferenceView& view : bundle.views)
        for (int y = kAt; y < kAt + kHole; ++y)
            for (int x = kAt; x < kAt + kHole; ++x) view.depth.at(x, y) = kNoDepth;
    RenderSettings settings;
    settings.lighting.lights.push_back({.kind = Light::Kind::directional, .vector = {0, 0, 1}});
    settings.lighting.ambient = glm::vec3(0.05f);
    const Camera own = bundle.views[1].camera;
    Camera beside = own;
    beside.position.x += 1e-3;
    const auto is = [&](const Frame& frame, int x, int y) {
        return glm::vec3(frame.colour.at(x, y));
    };
    const Frame dark = drawn(bundle, own, settings), other = drawn(bundle, beside, settings),
                plain = drawn(bundle, own, {});
    for (int y = kAt; y < kAt + kHole; ++y)
        for (int x = kAt; x < kAt + kHole; ++x) {
            EXPECT_LT(glm::length(is(dark, x, y) - is(other, x, y)), 0.05f) << x << ", " << y;
            EXPECT_LT(is(dark, x, y).r, 0.5f * is(plain, x, y).r) << x << ", " << y;
        }
    // The sky gives off its own.
    EXPECT_LT(glm::length(is(dark, kWide / 2, kHigh / 2) - is(plain, kWide / 2, kHigh / 2)), 0.1f);
}

TEST(Unmeasured, EmptinessIsNotSky) {
    const Camera camera = wallCamera(0.04);
    const Bundle bundle = walls(NoDepth::empty);
    for (const RenderMode mode : {RenderMode::surface, RenderMode::splat})
        EXPECT_EQ(drawn(bundle, camera, mode, true).colour,
                  drawn(bundle, camera, mode, false).colour);
}

TEST(Unmeasured, IsBehindARememberedBackground) {
    Bundle bundle = walls();
    ReferenceView remembered = wallWithWindow(wallCamera(0.1), NoDepth::unknown);
    // A blind, in a quarter of the window, was down at another time.
    for (int y = 0; y < kHigh / 2; ++y)
        for (int x = 0; x < kWide / 2; ++x)
            if (!hasPoint(remembered.depth.at(x, y))) {
                remembered.depth.at(x, y) = static_cast<float>(kEye);
                remembered.texture.rgba8()->at(x, y) = {255, 0, 0, 255};
            }
    remembered.name = "remembered";
    remembered.background = true;
    bundle.views.push_back(remembered);
    for (const RenderMode mode : {RenderMode::surface, RenderMode::splat}) {
        const Frame frame = drawn(bundle, wallCamera(0.04), mode, true);
        const glm::vec4 blind = frame.colour.at(kWide / 2 - 10, kHigh / 2 - 8),
                        sky = frame.colour.at(kWide / 2 + 8, kHigh / 2 + 8);
        EXPECT_GT(blind.r, 0.9f);
        EXPECT_GT(sky.b, sky.r);
        EXPECT_GT(sky.a, 0.99f);
    }
}

}  // namespace
}  // namespace stx
