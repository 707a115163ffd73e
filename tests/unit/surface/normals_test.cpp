#include "lib/surface/normals.hpp"

#include <gtest/gtest.h>

#include "lib/base/parallel.hpp"
#include "lib/surface/depth_gradient.hpp"
#include "tests/unit/surface/analytic.hpp"

namespace stx {
namespace {

/// Mean angle in degrees between a baked view's normals and the truth.
double meanError(const ReferenceView& view, const Image<glm::vec3>& truth) {
    double sum = 0;
    std::int64_t points = 0;
    for (std::size_t i = 0; i < view.depth.count(); ++i) {
        if (!hasPoint(view.depth.pixels()[i])) continue;
        const double c = glm::dot(view.normal.pixels()[i], truth.pixels()[i]);
        sum += glm::degrees(std::acos(std::clamp(c, -1.0, 1.0)));
        ++points;
    }
    return sum / static_cast<double>(points);
}

double errorOf(const analytic::Solid& solid, const Camera& camera, int bits,
               BakeSettings::Method method, double looserRange = 1) {
    Image<glm::vec3> truth;
    Bundle bundle;
    bundle.views.push_back(analytic::capture(solid, camera, 32, &truth));
    auto& view = bundle.views[0];
    view.depthBits = bits;
    view.farPlane = view.nearPlane + (view.farPlane - view.nearPlane) * looserRange;
    for (float& z : view.depth.pixels())
        z = static_cast<float>(view.depthCode().decode(view.depthCode().encode(z)));
    Job job;
    BakeSettings settings;
    settings.method = method;
    EXPECT_TRUE(bake(bundle, settings, job));
    return meanError(bundle.views[0], truth);
}

constexpr auto kPaper = BakeSettings::Method::paper;
constexpr auto kRobust = BakeSettings::Method::robust;
const Camera kCamera = analytic::lookingAt({1.5, 1.2, 2.5}, 512);
const Camera kOrtho = analytic::lookingAt({1.5, 1.2, 2.5}, 512, true);

TEST(Normals, SixteenBitsAreExactToAFifthOfADegree) {
    for (const auto& solid :
         {analytic::sphere, analytic::torus, analytic::bumpy, analytic::boxes}) {
        for (const auto& camera : {kCamera, kOrtho}) {
            EXPECT_LT(errorOf(solid, camera, 16, kRobust), 0.2);
            EXPECT_LT(errorOf(solid, camera, 16, kPaper), 0.8);
        }
    }
}

TEST(Normals, EightBitStairsAreFittedAway) {
    for (const auto& solid :
         {analytic::sphere, analytic::torus, analytic::bumpy, analytic::boxes}) {
        for (const auto& camera : {kCamera, kOrtho}) {
            EXPECT_LT(errorOf(solid, camera, 8, kRobust), 2.0);
            EXPECT_GT(errorOf(solid, camera, 8, kPaper), 5.0)
                << "stairs should spoil plain differences";
        }
    }
}

TEST(Normals, LoosePlanesWidenTheWindow) {
    EXPECT_LT(errorOf(analytic::sphere, kCamera, 8, kRobust, 5), 3.0);
    EXPECT_LT(errorOf(analytic::torus, kCamera, 8, kRobust, 5), 5.0);
    EXPECT_LT(errorOf(analytic::boxes, kCamera, 8, kRobust, 5), 6.0);
}

TEST(Normals, NeverAcrossADiscontinuity) {
    // Two planes that face the camera, far apart: each pixel beside the gap faces it too.
    Bundle bundle;
    ReferenceView view;
    view.camera = Camera::fromFieldOfView({0, 0, 0}, {1, 0, 0, 0}, {1, 1}, false, 32, 32);
    view.nearPlane = 1;
    view.farPlane = 4;
    view.depth = Image<float>(32, 32, 2.0f);
    for (int y = 0; y < 32; ++y) {
        for (int x = 16; x < 32; ++x) view.depth.at(x, y) = 3.0f;
    }
    view.texture = Rgba8Image(32, 32, glm::u8vec4(255));
    for (const auto method : {kPaper, kRobust}) {
        for (const int bits : {8, 16, 32}) {
            view.depthBits = bits;
            bundle.views = {view};
            BakeSettings settings;
            settings.method = method;
            Job job;
            ASSERT_TRUE(bake(bundle, settings, job));
            for (const auto& n : bundle.views[0].normal.pixels()) EXPECT_GT(n.z, 0.99999f);
        }
    }
}

TEST(Normals, OfAWallSeenEdgeOnInFewPixelsAreItsOwn) {
    // Its distance changes by 5 % and more from pixel to pixel: up to 90 degrees off where that was
    // taken for a step, all over.
    Bundle bundle;
    ReferenceView& view = bundle.views.emplace_back();
    view.camera = Camera::fromFieldOfView({0, 0, 0}, {1, 0, 0, 0}, {1.6, 1.6}, false, 48, 48);
    const Camera& c = view.camera;
    const glm::dvec3 wall = glm::normalize(glm::dvec3(-1, 0.1, -0.2));
    view.depth = Image<float>(48, 48, kNoDepth);
    for (int y = 0; y < 48; ++y) {
        for (int x = 0; x < 48; ++x) {
            const double facing = glm::dot(wall, c.unproject(x + 0.5, y + 0.5, 1));
            if (facing < -0.05) view.depth.at(x, y) = static_cast<float>(-1 / facing);
        }
    }
    view.nearPlane = 0.5;
    view.farPlane = 30;
    view.depthBits = 32;
    view.texture = Rgba8Image(48, 48, glm::u8vec4(255));
    for (const auto method : {kPaper, kRobust}) {
        Bundle baked = bundle;
        Job job;
        ASSERT_TRUE(bake(baked, {.method = method}, job));
        const Image<glm::vec3> truth(48, 48, glm::vec3(wall));
        EXPECT_LT(meanError(baked.views[0], truth), 0.1);
    }
}

// Pixels at outlines are linked with none of those inside, so steep is what is between. They faced
// the viewpoint: 2 % of the normals of a sphere and 20 % of those of a small torus were over 45
// degrees off.
TEST(Normals, GoOnOverOutlines) {
    for (const auto& solid : {analytic::sphere, analytic::torus, analytic::bumpy}) {
        for (const bool orthographic : {false, true}) {
            for (const int size : {48, 128}) {
                Bundle bundle;
                Image<glm::vec3> truth;
                bundle.views.push_back(analytic::capture(
                    solid, analytic::lookingAt({1.2, 0.8, 2.8}, size, orthographic), 16, &truth));
                Job job;
                ASSERT_TRUE(bake(bundle, {}, job));
                const ReferenceView& view = bundle.views[0];
                int points = 0, off = 0;
                for (std::size_t i = 0; i < truth.count(); ++i) {
                    if (!hasPoint(view.depth.pixels()[i])) continue;
                    ++points;
                    off += glm::dot(view.normal.pixels()[i], truth.pixels()[i]) < std::sqrt(0.5f);
                }
                EXPECT_LE(off, 0.003 * points) << "of " << points << " in " << size << " pixels";
            }
        }
    }
}

// Each round looked at all that was left: time grew with the pixels to the power of 1.5.
TEST(Normals, SlopesGoOnFarInTimeThatGrowsWithThePixels) {
    constexpr int kSide = 1200, kKnown = 6;
    const float levels[] = {1.0f, 1.6f, 2.4f, 3.6f, 5.4f, 8.1f};
    ReferenceView view;
    view.camera = Camera::fromFieldOfView({0, 0, 0}, {1, 0, 0, 0}, {0.9, 0.9}, false, kSide, kSide);
    view.depthBits = 32;
    view.depth = Image<float>(kSide, kSide);
    for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x)
            view.depth.at(x, y) = x < kKnown && y < kKnown ? 1.0f : levels[x % 2 * 3 + y % 3];
    DepthSurface surface = depthSurface(view, {});
    EXPECT_NE(surface.gradient.at(kSide - 1, kSide - 1), glm::vec2(0)) << "it faces the viewpoint";
    continueSlopes(view.camera, surface);
    for (const glm::vec2 gradient : surface.gradient.pixels()) ASSERT_EQ(gradient, glm::vec2(0));
}

TEST(Normals, LonelyPointsFaceTheViewpoint) {
    Bundle bundle;
    ReferenceView view;
    view.camera =
        Camera::fromFieldOfView({1, 2, 3}, quatFromAxisAngle({0, 1, 0, 0.5}), {1, 1}, false, 9, 9);
    view.depth = Image<float>(9, 9, kNoDepth);
    view.depth.at(1, 7) = 20.0f;
    view.texture = Rgba8Image(9, 9, glm::u8vec4(255));
    bundle.views = {view};
    Job job;
    ASSERT_TRUE(bake(bundle, {}, job));
    const auto& v = bundle.views[0];
    EXPECT_GT(glm::dot(v.normal.at(1, 7), -glm::vec3(v.camera.viewDirection(1.5, 7.5))), 0.99999f);
    EXPECT_EQ(v.normal.at(0, 0), glm::vec3(0));
    EXPECT_GT(glm::length(v.splatU.at(1, 7)), 0.5f * v.camera.sampleSpacing(20).x);
}

TEST(Splats, AreTangentAndCloseTheLattice) {
    for (const auto& camera : {kCamera, kOrtho}) {
        Bundle bundle;
        bundle.views.push_back(analytic::capture(analytic::sphere, camera, 32));
        Job job;
        ASSERT_TRUE(bake(bundle, {}, job));
        const auto& v = bundle.views[0];
        int looked = 0;
        for (int y = 1; y + 1 < 512; y += 3) {
            for (int x = 1; x + 1 < 512; x += 3) {
                if (!hasPoint(v.depth.at(x, y)) || !hasPoint(v.depth.at(x + 1, y + 1))) continue;
                const glm::vec3 u = v.splatU.at(x, y), w = v.splatV.at(x, y), n = v.normal.at(x, y);
                const glm::dvec3 p = v.worldPoint(x, y);
                // The sphere's own normal: silhouettes are for other tests.
                if (glm::dot(p, glm::normalize(camera.position - p)) < 0.3) continue;
                EXPECT_LT(std::abs(glm::dot(glm::normalize(u), n)), 0.02f);
                EXPECT_LT(std::abs(glm::dot(glm::normalize(w), n)), 0.02f);
                // Half way to the diagonal neighbour is where the ellipse ends: u = v = 1/sqrt 2.
                const glm::dvec3 corner = 0.5 * (v.worldPoint(x + 1, y + 1) - p);
                const glm::dvec3 edge = std::sqrt(0.5) * glm::dvec3(u + w);
                EXPECT_LT(glm::length(corner - edge), 0.15 * glm::length(corner));
                ++looked;
            }
        }
        EXPECT_GT(looked, 5000);
    }
}

TEST(RenewSurface, FollowsDepthThatChangedAndLeavesAllElse) {
    Job job;
    Bundle bundle;
    bundle.views.push_back(
        analytic::capture(analytic::sphere, analytic::lookingAt({1.2, 0.8, 2.8}, 64), 32));
    ASSERT_TRUE(bake(bundle, {}, job));
    ReferenceView& view = bundle.views[0];
    view.metallicRoughness = Image<glm::vec2>(64, 64, glm::vec2(0.5f));
    view.emissive = Image<glm::vec3>(64, 64, glm::vec3(0.25f));
    // Of a mesh: depth does not tell them.
    for (glm::vec3& normal : view.normal.pixels()) normal = -normal;
    const ReferenceView before = view;
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 32; ++x) view.depth.at(x, y) *= 1 + 0.004f * static_cast<float>(x);
    view.depth.at(40, 32) = kNoDepth;
    Bundle fresh;
    fresh.views = {view};
    ASSERT_TRUE(bake(fresh, {}, job));
    renewSurface(view, before.depth);
    int changed = 0;
    for (int y = 0; y < 64; ++y) {
        for (int x = 0; x < 64; ++x) {
            const bool same = view.depth.at(x, y) == before.depth.at(x, y);
            const ReferenceView& expected = same ? before : fresh.views[0];
            ASSERT_EQ(view.normal.at(x, y), expected.normal.at(x, y)) << x << ' ' << y;
            ASSERT_EQ(view.splatU.at(x, y), expected.splatU.at(x, y)) << x << ' ' << y;
            ASSERT_EQ(view.splatV.at(x, y), expected.splatV.at(x, y)) << x << ' ' << y;
            changed += !same;
        }
    }
    EXPECT_GT(changed, 500);
    EXPECT_EQ(view.normal.at(40, 32), glm::vec3(0));
    EXPECT_EQ(view.metallicRoughness.at(40, 32), glm::vec2(0));
    EXPECT_EQ(view.emissive.at(40, 32), glm::vec3(0));
    EXPECT_EQ(view.metallicRoughness.at(41, 32), glm::vec2(0.5f));
    EXPECT_EQ(view.emissive.at(20, 32), glm::vec3(0.25f));
}

TEST(RenewSurface, GivesAViewNoImagesThatItLacks) {
    ReferenceView view =
        analytic::capture(analytic::sphere, analytic::lookingAt({1.2, 0.8, 2.8}, 16), 32);
    const Image<float> before = view.depth;
    view.depth.at(8, 8) *= 1.1f;
    renewSurface(view, before);
    EXPECT_TRUE(view.normal.empty() && view.splatU.empty() && view.emissive.empty());
    view.splatV = Image<glm::vec3>(16, 16, glm::vec3(0));
    renewSurface(view, before);
    EXPECT_NE(view.splatV.at(8, 8), glm::vec3(0));
    EXPECT_EQ(view.splatV.at(7, 8), glm::vec3(0));
    EXPECT_TRUE(view.normal.empty() && view.splatU.empty());
}

TEST(Normals, RgbRoundTrip) {
    EXPECT_EQ(rgbFromNormal(glm::vec3(0)), glm::u8vec3(0));
    EXPECT_EQ(normalFromRgb(glm::u8vec3(0)), glm::vec3(0));
    EXPECT_EQ(rgbFromNormal({0, 0, 1}), glm::u8vec3(128, 128, 255));
    EXPECT_EQ(rgbFromNormal({-1, 0, 0}).x, 0);
    for (int i = 0; i < 1000; ++i) {
        const double z = -1 + 2 * (i + 0.5) / 1000, a = i * 2.399963;
        const double r = std::sqrt(1 - z * z);
        const glm::vec3 n(r * std::cos(a), r * std::sin(a), z);
        EXPECT_NE(rgbFromNormal(n), glm::u8vec3(0));
        EXPECT_GT(glm::dot(n, normalFromRgb(rgbFromNormal(n))), std::cos(glm::radians(0.4)));
    }
}

TEST(Normals, SameOnAnyNumberOfThreads) {
    Bundle one, many;
    one.views.push_back(analytic::capture(analytic::bumpy, analytic::lookingAt({1, 1, 3}, 128), 8));
    many = one;
    Job job;
    {
        const ThreadLimit limit(1);
        ASSERT_TRUE(bake(one, {}, job));
    }
    const ThreadLimit limit(7);
    ASSERT_TRUE(bake(many, {}, job));
    EXPECT_EQ(one.views[0].normal, many.views[0].normal);
    EXPECT_EQ(one.views[0].splatU, many.views[0].splatU);
    EXPECT_EQ(one.views[0].splatV, many.views[0].splatV);
}

TEST(Normals, OfOneViewStopWithTheJob) {
    Bundle bundle;
    bundle.views.push_back(
        analytic::capture(analytic::sphere, analytic::lookingAt({0, 0, 3}, 8), 16));
    const auto change = bakeOfViews({});
    ASSERT_TRUE(change);
    Job job;
    EXPECT_TRUE(change->change(bundle.views[0], job));
    job.cancelled = true;
    const auto stopped = change->change(bundle.views[0], job);
    ASSERT_FALSE(stopped);
    EXPECT_EQ(stopped.error().code, ErrorCode::failed);
}

TEST(Normals, RefusesNonsense) {
    Bundle bundle;
    Job job;
    EXPECT_FALSE(bake(bundle, {}, job));
    bundle.views.push_back(
        analytic::capture(analytic::sphere, analytic::lookingAt({0, 0, 3}, 8), 16));
    BakeSettings settings;
    settings.discontinuity = std::nan("");
    EXPECT_FALSE(bake(bundle, settings, job));
    job.limits.maxMemoryBytes = 100;
    EXPECT_FALSE(bake(bundle, {}, job));
}

}  // namespace
}  // namespace stx
