#include "lib/refine/noise.hpp"

#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "lib/refine/strays.hpp"
#include "tests/noisy_depth.hpp"

namespace stx {
namespace {

constexpr int kNoisySide = 96;

/// q of a slanted plane, nearer by `step` (a share) in its right half, with noise (a share).
Image<float> steppedPlane(double step, double noise) {
    Image<float> q(kNoisySide, kNoisySide);
    for (int y = 0; y < kNoisySide; ++y) {
        for (int x = 0; x < kNoisySide; ++x) {
            const double plane =
                (0.25 + 0.0002 * x + 0.0001 * y) * (x < kNoisySide / 2 ? 1 : 1 + step);
            q.at(x, y) = static_cast<float>(
                plane *
                (1 + noise * noisy::normal(7, static_cast<std::uint64_t>(y * kNoisySide + x))));
        }
    }
    return q;
}

/// Root of the mean square of what differs, as a share.
double difference(const Image<float>& a, const Image<float>& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.count(); ++i) {
        const double d = a.data()[i] / b.data()[i] - 1;
        sum += d * d;
    }
    return std::sqrt(sum / static_cast<double>(a.count()));
}

TEST(DepthNoise, IsMeasuredWhateverTheShape) {
    EXPECT_LT(depthNoise(steppedPlane(0.1, 0), {}), 1e-5);
    for (const double noise : {0.002, 0.005, 0.02}) {
        EXPECT_NEAR(depthNoise(steppedPlane(0, noise), {}), noise, 0.2 * noise);
        EXPECT_NEAR(depthNoise(steppedPlane(0.3, noise), {}), noise, 0.2 * noise);
    }
    EXPECT_EQ(depthNoise(Image<float>(8, 8, 0.0f), {}), 0.0f);
}

/// q in whole steps.
Image<float> inSteps(Image<float> q, double step) {
    for (float& value : q.pixels())
        value = static_cast<float>(std::round(static_cast<double>(value) / step) * step);
    return q;
}

// Disparities of a Kinect are eighths of a pixel: more than one in twenty bends are 0 then.
TEST(DepthNoise, OfDepthInStepsIsMeasured) {
    for (const double noise : {0.005, 0.02}) {
        // Values are around 0.26, steps noise / 2, 4, 8 and 32 of them.
        for (const double steps : {2.0, 4.0, 8.0, 32.0}) {
            EXPECT_NEAR(depthNoise(inSteps(steppedPlane(0.3, noise), 0.26 * noise / steps), {}),
                        noise, 0.25 * noise)
                << noise << " " << steps;
        }
    }
}

TEST(DepthNoise, StepsAloneAreNone) {
    for (const double step : {0.0005, 0.002, 0.01, 0.03})
        EXPECT_LT(depthNoise(inSteps(steppedPlane(0.3, 0), step), {}), 0.001) << step;
}

/// q of a ball so many pixels wide, from three radii away, with noise (a share).
Image<float> ballOf(int pixels, double noise) {
    Image<float> q(pixels, pixels, 0.0f);
    const double radius = pixels / 2.0;
    for (int y = 0; y < pixels; ++y) {
        for (int x = 0; x < pixels; ++x) {
            const double dx = (x + 0.5) / radius - 1, dy = (y + 0.5) / radius - 1;
            if (dx * dx + dy * dy > 0.98) continue;
            const double depth = 3 - std::sqrt(1 - dx * dx - dy * dy);
            const double error = noisy::normal(9, static_cast<std::uint64_t>(y * pixels + x));
            q.at(x, y) = static_cast<float>((1 + noise * error) / depth);
        }
    }
    return q;
}

// The sweep found balls of thirty pixels whose bend was taken for noise of a tenth of their depth.
TEST(DepthNoise, WhatBendsEvenlyIsNone) {
    for (const int pixels : {16, 24, 31, 64, 200})
        EXPECT_LT(depthNoise(ballOf(pixels, 0), {}), 0.001) << pixels;
    for (const int pixels : {31, 64, 200})
        EXPECT_NEAR(depthNoise(ballOf(pixels, 0.02), {}), 0.02, 0.01) << pixels;
    for (const int pixels : {31, 64, 200})
        for (const double step : {0.0005, 0.002, 0.01})
            EXPECT_LT(depthNoise(inSteps(ballOf(pixels, 0), step), {}), 0.001) << pixels << step;
}

TEST(DepthNoise, SmoothingLeavesAFifthOfItAndKeepsTheStep) {
    const Image<float> exact = steppedPlane(0.05, 0);
    Image<float> q = steppedPlane(0.05, 0.005);
    const float noise = depthNoise(q, {});
    const float left = smoothDepth(q, {}, noise);
    EXPECT_LT(left, noise);
    EXPECT_GT(left, difference(q, exact));
    EXPECT_LT(difference(q, exact), 0.005 / 4);
    // Nothing comes to lie between the two surfaces.
    for (int y = 0; y < kNoisySide; ++y)
        for (const int x : {kNoisySide / 2 - 1, kNoisySide / 2})
            EXPECT_NEAR(q.at(x, y) / exact.at(x, y), 1, 0.015) << x << " " << y;
}

// The sweep found walls of rooms whose noise stayed: no neighbour lay in the band around a point.
TEST(DepthNoise, SteepSurfacesLoseItToo) {
    Image<float> exact(kNoisySide, kNoisySide), q(kNoisySide, kNoisySide);
    constexpr double kNoise = 0.005;
    for (int y = 0; y < kNoisySide; ++y) {
        for (int x = 0; x < kNoisySide; ++x) {
            const double plane = 0.25 + 0.01 * x + 0.002 * y;
            exact.at(x, y) = static_cast<float>(plane);
            const double own = noisy::normal(5, static_cast<std::uint64_t>(y * kNoisySide + x));
            q.at(x, y) = static_cast<float>(plane * (1 + kNoise * own));
        }
    }
    const float noise = depthNoise(q, {});
    EXPECT_NEAR(noise, kNoise, 0.3 * kNoise);
    smoothDepth(q, {}, noise);
    EXPECT_LT(difference(q, exact), kNoise / 2);
}

TEST(DepthNoise, PointsOfSteepSurfacesAreNoStraysAndThoseThatNoOtherViewKnowsStay) {
    Image<float> q(kNoisySide, kNoisySide);
    for (int y = 0; y < kNoisySide; ++y)
        for (int x = 0; x < kNoisySide; ++x)
            q.at(x, y) = static_cast<float>(0.25 + 0.01 * x + 0.01 * y);
    Camera camera;
    camera.width = camera.height = kNoisySide;
    camera.fx = camera.fy = kNoisySide;
    const PixelSpace space(camera, 0.0);
    const int stray = kNoisySide / 2;
    Image<float> exact = q;
    q.at(stray, stray) *= 1.3f;
    std::vector<NoisyView> views(2);
    for (NoisyView& view : views) {
        view.space = &space;
        view.q = &q;
        view.surface = Image<glm::vec3>(kNoisySide, kNoisySide, glm::vec3(0, 0, 1e-5f));
    }
    EXPECT_EQ(removeStrays(std::span(views).first(1)), 0) << "nobody else tells";
    views[1].q = &exact;
    removeStrays(views);
    int removed = 0;
    for (int y = 1; y + 1 < kNoisySide; ++y)
        for (int x = 1; x + 1 < kNoisySide; ++x) removed += !(q.at(x, y) > 0.0f);
    EXPECT_LT(q.at(stray, stray), 0.0f);
    EXPECT_LE(removed, 9);
}

// The sweep found balls in splat mode that lost their outermost points, since another view shows
// them, too.
TEST(DepthNoise, PointsOfRimsThatOtherViewsShowAreNoStrays) {
    constexpr int kBallSide = 64;
    Camera camera;
    camera.width = camera.height = kBallSide;
    camera.fx = camera.fy = kBallSide;
    const PixelSpace space(camera, 0.0);
    std::array<Image<float>, 2> balls{ballOf(kBallSide, 0), ballOf(kBallSide, 0)};
    std::vector<NoisyView> views(2);
    for (std::size_t i = 0; i < views.size(); ++i) {
        views[i].space = &space;
        views[i].q = &balls[i];
        views[i].surface = Image<glm::vec3>(kBallSide, kBallSide, glm::vec3(0, 0, 1e-5f));
    }
    EXPECT_EQ(removeStrays(views), 0);
    // In front of clear background it is one.
    balls[0].at(1, 1) = 0.3f;
    EXPECT_EQ(removeStrays(views), 1);
    EXPECT_LT(balls[0].at(1, 1), 0.0f);
}

TEST(DepthNoise, ExactDepthStaysAsItIs) {
    const Image<float> exact = steppedPlane(0.05, 0);
    Image<float> q = exact;
    EXPECT_EQ(smoothDepth(q, {}, depthNoise(q, {})), 0.0f);
    for (std::size_t i = 0; i < q.count(); ++i) ASSERT_EQ(q.data()[i], exact.data()[i]);
}

}  // namespace
}  // namespace stx
