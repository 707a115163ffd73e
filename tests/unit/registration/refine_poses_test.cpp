// Poses that were disturbed by a known motion come back; right ones stay.

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "lib/base/parallel.hpp"
#include "lib/refine/poses.hpp"
#include "lib/registration/refine_poses.hpp"

using namespace stx;

namespace {

/// A wavy, painted wall, 4 x 3 units, seen from in front. Rays are followed to the surface
/// z = relief * height(x, y).
double height(double x, double y) {
    return std::sin(1.7 * x) * std::cos(2.3 * y);
}

glm::vec3 paint(double x, double y) {
    const double a = 0.5 + 0.25 * std::sin(9 * x + 3 * std::sin(4 * y)) + 0.2 * std::sin(23 * y);
    const double b = 0.5 + 0.4 * std::sin(13 * y - 5 * x);
    return {a, b, 0.5 * (a + b)};
}

ReferenceView photograph(const Camera& camera, float exposure, double relief) {
    ReferenceView view;
    view.camera = camera;
    view.depthBits = 32;
    view.depth = Image<float>(camera.width, camera.height, kNoDepth);
    Rgba8Image colour(camera.width, camera.height);
    for (int y = 0; y < camera.height; ++y) {
        for (int x = 0; x < camera.width; ++x) {
            const glm::dvec3 ray = camera.orientation * camera.unproject(x + 0.5, y + 0.5, 1.0);
            double t = 3;
            for (int i = 0; i < 60; ++i) {  // contracts: the wall is less steep than the rays
                const glm::dvec3 p = camera.position + t * ray;
                t += 0.7 * (p.z - relief * height(p.x, p.y)) / -ray.z;
            }
            const glm::dvec3 p = camera.position + t * ray;
            if (std::abs(p.x) > 2 || std::abs(p.y) > 1.5) continue;
            view.depth.at(x, y) = static_cast<float>(t);
            colour.at(x, y) = glm::u8vec4(
                glm::clamp(exposure * paint(p.x, p.y), 0.0f, 1.0f) * 255.0f + 0.5f, 255);
        }
    }
    view.texture = colour;
    view.nearPlane = 1;
    view.farPlane = 10;
    return view;
}

/// Five views of the wall, 0.6 units apart, all looking at its middle; the last has 2 % more light.
Bundle wall(double relief = 0.25) {
    Bundle bundle;
    for (int i = 0; i < 5; ++i) {
        const glm::dvec3 eye(0.6 * (i - 2), 0.3 * (i % 2), 3.2 + 0.1 * i);
        const auto orientation = lookAt(eye, {0.1 * i, 0, 0});
        const Camera camera =
            Camera::fromFieldOfView(eye, *orientation, {1.0, 0.8}, false, 200, 160);
        bundle.views.push_back(photograph(camera, i == 4 ? 1.02f : 1.0f, relief));
        bundle.views.back().name = "v" + std::to_string(i);
    }
    bundle.bounds = bundle.computeBounds();
    return bundle;
}

/// Each pose off by up to `turn` radians and `shift` units.
void disturb(Bundle& bundle, double turn, double shift) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> unit(-1, 1);
    for (ReferenceView& view : bundle.views) {
        const glm::dvec3 axis =
            glm::normalize(glm::dvec3(unit(random), unit(random), unit(random)));
        view.camera.orientation =
            glm::normalize(glm::angleAxis(turn, axis) * view.camera.orientation);
        view.camera.position +=
            shift * glm::normalize(glm::dvec3(unit(random), unit(random), unit(random)));
    }
}

struct Difference {
    double turn = 0, shift = 0;
};

/// Of the poses of all views relative to the first view's.
Difference relativeTo(const Bundle& truth, const Bundle& found) {
    Difference worst;
    const auto relative = [](const Bundle& b, std::size_t i) {
        return glm::inverse(b.views[0].camera.worldFromCamera()) *
               b.views[i].camera.worldFromCamera();
    };
    for (std::size_t i = 1; i < truth.views.size(); ++i) {
        const glm::dmat4 a = relative(truth, i), b = relative(found, i);
        const glm::dmat3 r = glm::dmat3(a) * glm::transpose(glm::dmat3(b));
        const double sine =
            0.5 * glm::length(glm::dvec3(r[1][2] - r[2][1], r[2][0] - r[0][2], r[0][1] - r[1][0]));
        worst.turn = std::max(worst.turn, std::asin(std::min(1.0, sine)));
        worst.shift = std::max(worst.shift, glm::length(glm::dvec3(a[3] - b[3])));
    }
    return worst;
}

TEST(RefinePoses, DisturbedPosesComeBack) {
    const Bundle truth = wall();
    Bundle bundle = truth;
    disturb(bundle, glm::radians(1.0), 0.02);
    Job job;
    const auto done = refinePoses(bundle, {}, job);
    ASSERT_TRUE(done) << done.error().text();
    const Difference left = relativeTo(truth, bundle);
    EXPECT_GT(done->before.relative, 0.002);  // of a quarter of the points
    EXPECT_LT(done->after.relative, 0.0005);
    EXPECT_LT(left.turn, glm::radians(0.02));
    EXPECT_LT(left.shift, 0.001);
    EXPECT_LT(done->maxTurn, glm::radians(3.0));
    for (std::size_t i = 0; i < truth.views.size(); ++i) {
        EXPECT_EQ(bundle.views[i].camera.fx, truth.views[i].camera.fx);
        EXPECT_EQ(bundle.views[i].depth, truth.views[i].depth);
        EXPECT_TRUE(bundle.views[i].camera.check());
    }
}

// Exact depth says so much of the directions across a wall that colours' say on those along it was
// taken for none.
TEST(RefinePoses, ColoursAlignAWallThatIsNearlyFlat) {
    for (const double relief : {0.05, 0.01, 0.0}) {
        const Bundle truth = wall(relief);
        Bundle bundle = truth;
        disturb(bundle, glm::radians(1.0), 0.02);
        Job job;
        ASSERT_TRUE(refinePoses(bundle, {}, job));
        const Difference left = relativeTo(truth, bundle);
        EXPECT_LT(left.turn, glm::radians(0.02)) << relief;
        EXPECT_LT(left.shift, 0.001) << relief;
    }
}

// They are in the world: left as they were, pictures in light are of surfaces that are turned.
TEST(RefinePoses, NormalsTurnWithTheirCameras) {
    const glm::dvec3 given(0.6, 0, 0.8);  // as the camera has it
    Bundle bundle = wall();
    disturb(bundle, glm::radians(1.0), 0.02);
    for (ReferenceView& view : bundle.views)
        view.normal = Image<glm::vec3>(view.depth.width(), view.depth.height(),
                                       glm::vec3(view.camera.orientation * given));
    Bundle aligned = bundle;
    Job job;
    ASSERT_TRUE(refinePoses(bundle, {}, job));
    const auto report = alignPoses(aligned, AlignPoses::asked, job);
    ASSERT_TRUE(report);
    EXPECT_EQ(report->views, 5);
    for (const Bundle* done : {&bundle, &aligned})
        for (const ReferenceView& view : done->views)
            EXPECT_LT(
                glm::distance(glm::dvec3(view.normal.at(100, 80)), view.camera.orientation * given),
                1e-6);
}

TEST(RefinePoses, RightPosesStay) {
    const Bundle truth = wall();
    Bundle bundle = truth;
    Job job;
    const auto done = refinePoses(bundle, {}, job);
    ASSERT_TRUE(done);
    EXPECT_LT(done->maxTurn, glm::radians(0.01));
    EXPECT_LT(done->maxShift, 0.001);
}

TEST(RefinePoses, ViewsWithoutOverlapStay) {
    Bundle bundle = wall();
    disturb(bundle, glm::radians(1.0), 0.02);
    // The same picture, far away: it overlaps with none.
    bundle.views.push_back(bundle.views[0]);
    bundle.views.back().camera.position.x += 100;
    const Camera alone = bundle.views.back().camera;
    Job job;
    ASSERT_TRUE(refinePoses(bundle, {}, job));
    EXPECT_EQ(bundle.views.back().camera.position, alone.position);
    EXPECT_EQ(bundle.views.back().camera.orientation, glm::normalize(alone.orientation));
    // The others keep their mean.
    Bundle single;
    single.views.push_back(bundle.views[0]);
    const auto none = refinePoses(single, {}, job);
    ASSERT_TRUE(none);
    EXPECT_EQ(none->before.pairs, 0);
}

TEST(RefinePoses, TheSameOnAnyNumberOfThreads) {
    Bundle one = wall();
    disturb(one, glm::radians(0.5), 0.01);
    Bundle three = one;
    Job job;
    {
        const ThreadLimit limit(1);
        ASSERT_TRUE(refinePoses(one, {}, job));
    }
    const ThreadLimit limit(3);
    ASSERT_TRUE(refinePoses(three, {}, job));
    for (std::size_t i = 0; i < one.views.size(); ++i)
        EXPECT_EQ(one.views[i].camera, three.views[i].camera);
}

PoseRefinementSettings ifColoursTell() {
    PoseRefinementSettings settings;
    settings.onlyIfColoursTell = true;
    return settings;
}

/// Depth off by half a percent, each pixel by itself.
void addNoise(Bundle& bundle) {
    std::mt19937 random(11);
    std::normal_distribution<float> normal(0, 0.005f);
    for (ReferenceView& view : bundle.views)
        for (float& depth : view.depth.pixels())
            if (hasPoint(depth)) depth *= 1 + normal(random);
}

TEST(RefinePoses, ColoursTellThatPosesWereOff) {
    for (const bool noisy : {false, true}) {
        const Bundle truth = wall();
        Bundle bundle = truth;
        if (noisy) addNoise(bundle);
        disturb(bundle, glm::radians(0.5), 0.01);
        Job job;
        const auto done = refinePoses(bundle, ifColoursTell(), job);
        ASSERT_TRUE(done);
        EXPECT_TRUE(done->kept) << noisy;
        EXPECT_LT(done->coloursAfter, 0.8 * done->coloursBefore);
        EXPECT_LT(relativeTo(truth, bundle).turn, glm::radians(noisy ? 0.1 : 0.02));
    }
}

TEST(RefinePoses, ColoursTellThatPosesWereRight) {
    for (const bool noisy : {false, true}) {
        Bundle bundle = wall();
        if (noisy) addNoise(bundle);
        const Bundle given = bundle;
        Job job;
        const auto done = refinePoses(bundle, ifColoursTell(), job);
        ASSERT_TRUE(done);
        EXPECT_FALSE(done->kept) << noisy;
        for (std::size_t i = 0; i < given.views.size(); ++i)
            EXPECT_EQ(bundle.views[i].camera, given.views[i].camera);
    }
}

TEST(RefinePoses, SamplesShowTheSamePoints) {
    const ReferenceView view = wall().views[1];
    const PoseSample sample = poseSampleOf(view, 200 * 160 / 16);
    EXPECT_EQ(sample.header.camera.width, 50);
    EXPECT_EQ(sample.depth.size(), glm::ivec2(50, 40));
    EXPECT_EQ(sample.grey.front().size(), glm::ivec2(50, 40));
    int points = 0;
    for (int y = 0; y < 40; ++y) {
        for (int x = 0; x < 50; ++x) {
            const float dist = sample.depth.at(x, y);
            if (!hasPoint(dist)) continue;
            ++points;
            const glm::dvec3 p =
                view.camera.position +
                view.camera.orientation * sample.header.camera.unproject(x + 0.5, y + 0.5, dist);
            EXPECT_NEAR(p.z, 0.25 * height(p.x, p.y), 2e-4);
        }
    }
    EXPECT_GT(points, 1500);
    // The whole view, to the bit.
    EXPECT_EQ(poseSampleOf(view).depth, view.depth);
    EXPECT_EQ(poseSampleOf(view).header.camera, view.camera);
}

TEST(RefinePoses, SamplesOfAnyNumberOfViewsTakeLittle) {
    for (const std::size_t views : {1, 5, 10, 11, 100, 1000})
        EXPECT_LE(std::max<std::uint64_t>(views, 10) * samplePixels(views) * 10, 41'000'000u)
            << views;
    EXPECT_EQ(samplePixels(7), 640u * 480u);
}

TEST(RefinePoses, CancelledIsAnError) {
    Bundle bundle = wall();
    Job job;
    job.cancelled = true;
    EXPECT_FALSE(refinePoses(bundle, {}, job));
}

}  // namespace

/// Colour from a second camera beside the one of the depth fits no pose of it.
TEST(RefinePoses, WhatWouldBeWorseIsNotKept) {
    Bundle bundle = wall();
    for (std::size_t i = 0; i < bundle.views.size(); ++i) {
        const Rgba8Image colour = *bundle.views[i].texture.rgba8();
        Rgba8Image& moved = *bundle.views[i].texture.rgba8();
        const int shift = i % 2 ? 4 : -4;
        for (int y = 0; y < colour.height(); ++y)
            for (int x = 0; x < colour.width(); ++x)
                moved.at(x, y) = colour.at(std::clamp(x + shift, 0, colour.width() - 1), y);
    }
    const Bundle given = bundle;
    Job job;
    const auto done = refinePoses(bundle, {}, job);
    ASSERT_TRUE(done);
    EXPECT_GT(done->after.relative, done->before.relative) << "the case is of no use";
    EXPECT_FALSE(done->kept);
    for (std::size_t i = 0; i < bundle.views.size(); ++i) {
        EXPECT_EQ(bundle.views[i].camera.position, given.views[i].camera.position);
        EXPECT_EQ(bundle.views[i].camera.orientation, given.views[i].camera.orientation);
    }
    EXPECT_LE(measureDepthDisagreement(bundle).relative, done->before.relative * (1 + 1e-9));
}
