#include <algorithm>
#include <cmath>
#include <numeric>

#include <gtest/gtest.h>
#include <glm/gtc/packing.hpp>
#include <glm/gtx/quaternion.hpp>

#include "lib/base/parallel.hpp"
#include "lib/capture/capture.hpp"
#include "lib/geometry/depth_code.hpp"
#include "lib/model/texture.hpp"
#include "lib/render/api/frame_picture.hpp"
#include "lib/render/mesh/mesh_renderer.hpp"
#include "lib/splats/draw.hpp"
#include "tests/every_target.hpp"
#include "tests/unit/splats/random_cloud.hpp"

namespace stx {
namespace {

/// What the published formulas give, pixel by pixel, in doubles: no tiles, no vectors, nothing left
/// out but what the rules leave out. Written from the papers alone, with matrices written out.
struct Truth {
    Image<glm::dvec4> colour;  // premultiplied
    Image<double> depth;       // infinity where less than one half is covered
};

glm::dvec3 harmonics(const SplatCloud& cloud, std::size_t i, glm::dvec3 d) {
    const double x = d.x, y = d.y, z = d.z;
    const double c1 = std::sqrt(3 / (4 * M_PI)), c2 = std::sqrt(15 / (4 * M_PI)),
                 c3 = std::sqrt(35 / (32 * M_PI));
    const double basis[15] = {-c1 * y,
                              c1 * z,
                              -c1 * x,
                              c2 * x * y,
                              -c2 * y * z,
                              std::sqrt(5 / (16 * M_PI)) * (3 * z * z - 1),
                              -c2 * x * z,
                              c2 / 2 * (x * x - y * y),
                              -c3 * y * (3 * x * x - y * y),
                              std::sqrt(105 / (4 * M_PI)) * x * y * z,
                              -std::sqrt(21 / (32 * M_PI)) * y * (5 * z * z - 1),
                              std::sqrt(7 / (16 * M_PI)) * z * (5 * z * z - 3),
                              -std::sqrt(21 / (32 * M_PI)) * x * (5 * z * z - 1),
                              std::sqrt(105 / (16 * M_PI)) * z * (x * x - y * y),
                              -c3 * x * (x * x - 3 * y * y)};
    glm::dvec3 colour(cloud.colours[i]);
    const int padded = SplatCloud::paddedCount(cloud.degree);
    for (int k = 0; k < SplatCloud::coefficientCount(cloud.degree); ++k)
        for (int c = 0; c < 3; ++c)
            colour[c] += basis[k] *
                         glm::unpackHalf1x16(cloud.harmonics[(i * 3 + static_cast<std::size_t>(c)) *
                                                                 static_cast<std::size_t>(padded) +
                                                             static_cast<std::size_t>(k)]);
    return glm::max(colour, 0.0);
}

Truth truthOf(const SplatCloud& cloud, const Camera& camera) {
    Truth out{Image<glm::dvec4>(camera.width, camera.height, glm::dvec4(0.0)),
              Image<double>(camera.width, camera.height, INFINITY)};
    const glm::dmat4 view = camera.cameraFromWorld();
    struct Flat {
        glm::dvec2 at;
        glm::dmat2 inverse;
        glm::dvec3 colour, centre;
        glm::dmat3 inverse3;
        double reach;
        double opacity, far;
    };
    std::vector<Flat> flats;
    for (std::size_t i = 0; i < cloud.positions.size(); ++i) {
        // Camera space with y down and z forward.
        const glm::dvec4 q(cloud.rotations[i]);
        const glm::dmat3 turn = glm::mat3_cast(glm::dquat(q.w, q.x, q.y, q.z));
        const glm::dvec3 s(cloud.scales[i]);
        const glm::dmat3 flip(1, 0, 0, 0, -1, 0, 0, 0, -1);
        const glm::dmat3 m =
            flip * glm::dmat3(view) * turn * glm::dmat3(s.x, 0, 0, 0, s.y, 0, 0, 0, s.z);
        const glm::dmat3 covariance = m * glm::transpose(m);
        const glm::dvec3 p =
            flip * glm::dvec3(view * glm::dvec4(glm::dvec3(cloud.positions[i]), 1));
        glm::dmat3 j(0.0);  // columns
        if (camera.orthographic) {
            j[0][0] = camera.fx;
            j[1][1] = camera.fy;
        } else {
            j[0][0] = camera.fx / p.z;
            j[1][1] = camera.fy / p.z;
            j[2][0] = -camera.fx * p.x / (p.z * p.z);
            j[2][1] = -camera.fy * p.y / (p.z * p.z);
        }
        const glm::dmat3 c = j * covariance * glm::transpose(j);
        const glm::dmat2 flat(c[0][0] + 0.3, c[0][1], c[1][0], c[1][1] + 0.3);
        const double scale = camera.orthographic ? 1 : 1 / p.z;
        flats.push_back(
            {{camera.cx + camera.fx * p.x * scale, camera.cy + camera.fy * p.y * scale},
             glm::inverse(flat),
             harmonics(cloud, i,
                       camera.orthographic
                           ? camera.forward()
                           : glm::normalize(glm::dvec3(cloud.positions[i]) - camera.position)),
             p,
             glm::inverse(covariance),
             3 * std::sqrt(covariance[2][2]),
             cloud.opacities[i],
             camera.orthographic ? p.z : glm::length(p)});
    }
    std::ranges::stable_sort(flats, {}, &Flat::far);
    for (int y = 0; y < camera.height; ++y) {
        for (int x = 0; x < camera.width; ++x) {
            double through = 1;
            for (const Flat& f : flats) {
                const glm::dvec2 d = glm::dvec2(x + 0.5, y + 0.5) - f.at;
                const double squares = glm::dot(d, f.inverse * d);
                const double alpha = std::min(0.99, f.opacity * std::exp(-0.5 * squares));
                if (squares > 9 || alpha < 1.0 / 255) continue;
                out.colour.at(x, y) += glm::dvec4(f.colour, 1) * (through * alpha);
                const double before = through;
                through *= 1 - alpha;
                if (!(before >= 0.5 && through < 0.5)) continue;
                const glm::dvec3 across((x + 0.5 - camera.cx) / camera.fx,
                                        (y + 0.5 - camera.cy) / camera.fy, 0);
                const glm::dvec3 from = camera.orthographic ? across : glm::dvec3(0.0),
                                 ray = glm::dvec3(0, 0, 1) +
                                       (camera.orthographic ? glm::dvec3(0.0) : across);
                out.depth.at(x, y) = std::clamp(
                    glm::dot(ray, f.inverse3 * (f.centre - from)) / glm::dot(ray, f.inverse3 * ray),
                    f.centre.z - f.reach, f.centre.z + f.reach);
            }
        }
    }
    return out;
}

void expectTruth(const SplatCloud& cloud, const Camera& camera) {
    Job job;
    const auto drawn = drawSplats(cloud, camera, true, job);
    ASSERT_TRUE(drawn) << drawn.error().text();
    const Truth truth = truthOf(cloud, camera);
    double squares = 0;
    std::size_t depths = 0, wrong = 0;
    for (int y = 0; y < camera.height; ++y) {
        for (int x = 0; x < camera.width; ++x) {
            const glm::dvec4 t = truth.colour.at(x, y);
            const glm::dvec4 off = t - glm::dvec4(drawn->colour.at(x, y));
            squares += glm::dot(off, off) / 4;
            const double depth = truth.depth.at(x, y);
            if (std::isinf(depth)) continue;
            ++depths;
            const float ours = drawn->depth.at(x, y);
            if (!(std::abs(ours - depth) <= 0.001 * depth)) ++wrong;
        }
    }
    const double mean = squares / (static_cast<double>(camera.width) * camera.height);
    EXPECT_GE(-10 * std::log10(mean), 60.0);
    EXPECT_GT(depths, 2000u);
    EXPECT_LE(static_cast<double>(wrong), 0.001 * static_cast<double>(depths));
}

TEST(DrawSplats, FollowsThePublishedFormulas) {
    const SplatCloud cloud = randomCloud(2000, 3, 7);
    expectTruth(cloud, cameraFrom({1.5, 1, 3}, 160, 120));
    expectTruth(cloud, cameraFrom({-3, 0.2, -1}, 97, 131));
}

TEST(DrawSplats, OrthographicCamerasTooOnEveryKindOfVectors) {
    Camera camera = cameraFrom({0.5, 2, 3}, 104, 104);
    camera.orthographic = true;
    camera.fx = camera.fy = 37;
    const SplatCloud cloud = randomCloud(2000, 2, 8);
    onEveryTarget([&] { expectTruth(cloud, camera); });
}

// Their centres are thousands of pixels outside: lines came out as dots, or not at all.
TEST(DrawSplats, NeedlesThatOnlyPassThroughThePictureAreWhole) {
    Camera camera = cameraFrom({0, 0, 3}, 104, 104);
    camera.orthographic = true;
    camera.fx = camera.fy = 37;
    for (const double degrees : {0.02, 37.0, 89.98, 120.0}) {
        const double angle = glm::radians(degrees);
        SplatCloud cloud;
        ASSERT_TRUE(cloud.resize(1, 0, Limits()));
        cloud.positions[0] = 150.0f * glm::vec3(std::cos(angle), std::sin(angle), 0);
        cloud.rotations[0] =
            glm::vec4(0, 0, std::sin(angle / 2), std::cos(angle / 2));  // x, y, z, w
        cloud.scales[0] = {100.0f, 0.002f, 0.002f};
        cloud.opacities[0] = 0.95f;
        cloud.colours[0] = glm::vec3(1);
        const Truth truth = truthOf(cloud, camera);
        onEveryTarget([&] {
            Job job;
            const auto drawn = drawSplats(cloud, camera, false, job);
            ASSERT_TRUE(drawn);
            int lit = 0;
            for (std::size_t i = 0; i < truth.colour.count(); ++i) {
                const double expected = truth.colour.data()[i].w;
                lit += expected > 0.1;
                EXPECT_NEAR(drawn->colour.data()[i].w, expected, 0.015) << degrees << ' ' << i;
            }
            EXPECT_GE(lit, 100) << degrees;
        });
    }
}

TEST(DrawSplats, TheSameOnAnyNumberOfThreads) {
    const SplatCloud cloud = randomCloud(200000, 1, 9);
    const Camera camera = cameraFrom({0, 0.5, 2.5}, 200, 200);
    Job job;
    const auto draw = [&](int threads) {
        const ThreadLimit limit(threads);
        return *drawSplats(cloud, camera, true, job);
    };
    const SplatPicture one = draw(1), three = draw(3);
    EXPECT_TRUE(one.colour == three.colour);
    EXPECT_TRUE(one.depth == three.depth);
    EXPECT_TRUE(one.normal == three.normal);
}

/// One disc of 0.3 in the plane through the origin with this normal.
SplatCloud disc(glm::dvec3 normal) {
    SplatCloud cloud;
    (void)cloud.resize(1, 0, Limits());
    const glm::dquat q = glm::rotation(glm::dvec3(0, 0, 1), glm::normalize(normal));
    cloud.rotations[0] = glm::vec4(q.x, q.y, q.z, q.w);
    cloud.scales[0] = {0.3f, 0.3f, 0.0f};
    cloud.opacities[0] = 1.0f;
    cloud.colours[0] = {1.0f, 0.5f, 0.0f};
    return cloud;
}

TEST(DrawSplats, DepthOfADiscIsThatOfItsPlane) {
    const glm::dvec3 normal(0.3, 0.2, 1);
    const Camera camera = cameraFrom({0, 0, 3}, 101, 101);
    Job job;
    const auto drawn = drawSplats(disc(normal), camera, true, job);
    ASSERT_TRUE(drawn);
    int seen = 0;
    for (int y = 0; y < 101; ++y) {
        for (int x = 0; x < 101; ++x) {
            if (!hasPoint(drawn->depth.at(x, y))) continue;
            ++seen;
            const glm::dvec3 point =
                camera.position +
                camera.orientation * camera.unproject(x + 0.5, y + 0.5, drawn->depth.at(x, y));
            EXPECT_NEAR(glm::dot(point, glm::normalize(normal)), 0.0, 1e-5);
            EXPECT_NEAR(glm::dot(glm::dvec3(drawn->normal.at(x, y)), glm::normalize(normal)), 1.0,
                        1e-5);
        }
    }
    EXPECT_GT(seen, 300);
}

TEST(DrawSplats, LinearColoursAreBlendedAsLight) {
    SplatCloud cloud = disc({0, 0, 1});
    cloud.linear = true;
    cloud.colours[0] = glm::vec3(0.2f);
    Job job;
    const auto drawn = drawSplats(cloud, cameraFrom({0, 0, 3}, 21, 21), false, job);
    const glm::vec4 middle = drawn->colour.at(10, 10);
    EXPECT_NEAR(middle.x / middle.w, 0.2f, 1e-4f);
}

TEST(DrawSplats, WhatIsBehindLinearColoursIsAddedAsLight) {
    Mesh mesh;
    auto cloud = disc({0, 0, 1});
    cloud.linear = true;
    cloud.opacities[0] = 0.8f;
    cloud.colours[0] = glm::vec3(0.2f);
    mesh.splats = std::make_shared<const SplatCloud>(cloud);
    mesh.positions = {{0, 0, 0}};
    mesh.points = {0};
    Job job;
    const Camera camera = cameraFrom({0, 0, 3}, 21, 21);
    const auto frame = makeMeshRenderer(mesh, {}, job)->render(camera);
    ASSERT_TRUE(frame);
    EXPECT_TRUE(frame->linear);
    const float alpha = frame->colour.at(10, 10).w;
    EXPECT_NEAR(rgba8From(*frame, glm::vec3(1.0f)).at(10, 10).r,
                255 * srgbFromLinear(0.2f * alpha + 1.0f - alpha), 1);
    // Views hold codes.
    const auto view = captureView(mesh, camera, "v", {}, job);
    ASSERT_TRUE(view) << view.error().text();
    EXPECT_FALSE(view->texture.isLinear());
    EXPECT_NEAR(view->texture.at(10, 10).x, srgbFromLinear(0.2f), 1.0 / 255);
}

TEST(DrawSplats, BrighterThanWhiteIsClippedBehindTheBackground) {
    Mesh mesh;
    auto cloud = disc({0, 0, 1});
    cloud.opacities[0] = 0.5f;
    cloud.colours[0] = glm::vec3(1.5f, 0.5f, 0);
    mesh.splats = std::make_shared<const SplatCloud>(cloud);
    for (const bool beyondOne : {true, false}) {
        RasterSettings settings;
        settings.lighting.beyondOne = beyondOne;
        Job job;
        auto image = rasterise(mesh, cameraFrom({0, 0, 3}, 21, 21), settings, job);
        ASSERT_TRUE(image);
        const glm::vec4 middle = image->colour.at(10, 10);
        EXPECT_NEAR(middle.x / middle.w, 1.5f, 1e-5f);
        EXPECT_NEAR(middle.y / middle.w, 0.5f, 1e-5f);
        Frame frame;
        frame.colour = std::move(image->colour);
        // Red is 0.75 and 0.25 times what is behind it, and green 0.25 and 0.5 times that.
        const glm::u8vec4 onBlack = rgba8From(frame, glm::vec3(0.0f)).at(10, 10);
        EXPECT_NEAR(onBlack.r, 0.75 * 255, 2);
        const glm::u8vec4 onWhite = rgba8From(frame, glm::vec3(1.0f)).at(10, 10);
        EXPECT_EQ(onWhite.r, 255);
        EXPECT_NEAR(onWhite.g, 0.75 * 255, 2);
    }
}

TEST(DrawSplats, WhatIsBehindOrAroundTheCameraIsNotDrawn) {
    SplatCloud cloud = disc({0, 0, 1});
    Job job;
    for (const glm::dvec3 eye : {glm::dvec3(0, 0, -3), glm::dvec3(0, 0, 0.0)}) {
        Camera camera = cameraFrom({0, 0, 3}, 21, 21);
        camera.position = eye;
        const auto drawn = drawSplats(cloud, camera, false, job);
        ASSERT_TRUE(drawn);
        for (const glm::vec4 c : drawn->colour.pixels()) EXPECT_EQ(c.w, 0.0f);
    }
}

TEST(CaptureOfSplats, SaysWhatIsTooFaintForDepth) {
    // A square of 20x20 splats that leave no gap, and the same half seen through.
    for (const float opacity : {0.1f, 1.0f}) {
        SplatCloud cloud;
        ASSERT_TRUE(cloud.resize(400, 0, Limits()));
        Mesh mesh;
        for (std::size_t i = 0; i < 400; ++i) {
            mesh.positions.emplace_back(0.1f * static_cast<float>(i % 20) - 0.95f,
                                        0.1f * static_cast<float>(i / 20) - 0.95f, 0.0f);
            mesh.points.push_back(static_cast<std::uint32_t>(i));
            cloud.rotations[i] = glm::vec4(0, 0, 0, 1);
            cloud.scales[i] = glm::vec3(0.07f);
            cloud.opacities[i] = i % 20 < 10 ? opacity : 1.0f;
            cloud.colours[i] = glm::vec3(0.5f);
        }
        cloud.positions = mesh.positions;
        mesh.splats = std::make_shared<const SplatCloud>(std::move(cloud));
        Job job;
        ASSERT_TRUE(captureBundle(mesh, {cameraFrom({0, 0, 3}, 64, 64)}, {}, job));
        const auto notes = job.takeNotes();
        if (opacity == 1.0f) {
            EXPECT_TRUE(notes.empty());
            continue;
        }
        ASSERT_EQ(notes.size(), 1u);
        EXPECT_NE(notes[0].find("has no depth"), std::string::npos);
    }
}

TEST(CaptureOfSplats, FramesWhatHidesHalfOfWhatIsBehind) {
    // A rod of one splat, turned by 30 degrees about z, and a huge one that frames nothing. Where
    // splats overlap, a quarter of each is half; of a faint one half of what it hides is looked at.
    for (const auto& [opacity, share] : {std::pair{0.98f, 0.98 / 0.25}, {0.5f, 2.0}, {0.3f, 2.0}}) {
        SplatCloud cloud;
        ASSERT_TRUE(cloud.resize(2, 0, Limits()));
        cloud.rotations[0] = glm::vec4(0, 0, std::sin(M_PI / 12), std::cos(M_PI / 12));
        cloud.rotations[1] = glm::vec4(0, 0, 0, 1);
        cloud.scales = {{1.0f, 0.1f, 0.05f}, {50, 50, 50}};
        cloud.opacities = {opacity, 0.1f};
        Mesh mesh;
        mesh.positions = cloud.positions;
        mesh.points = {0};
        mesh.splats = std::make_shared<const SplatCloud>(cloud);
        const double reach = std::sqrt(2 * std::log(share));
        const double x = reach * std::hypot(std::cos(M_PI / 6), 0.1 * std::sin(M_PI / 6)),
                     y = reach * std::hypot(std::sin(M_PI / 6), 0.1 * std::cos(M_PI / 6));
        const Bounds bounds = mesh.bounds();
        EXPECT_NEAR(bounds.max.x, x, 1e-5);
        EXPECT_NEAR(bounds.min.y, -y, 1e-5);
        EXPECT_NEAR(bounds.max.z, 0.05 * reach, 1e-5);
        Bounds framed;
        for (const glm::vec3 p : drawnPoints(mesh)) framed.add(p);
        EXPECT_NEAR(framed.max.x, x, 1e-5);
        EXPECT_NEAR(framed.min.y, -y, 1e-5);
        EXPECT_NEAR(framed.max.z, 0.05 * reach, 1e-5);
    }
}

TEST(CaptureOfSplats, SaysThatTheyAreTooFaintForViews) {
    Mesh mesh;
    auto cloud = disc({0, 0, 1});
    cloud.opacities[0] = 0.45f;
    mesh.positions = cloud.positions;
    mesh.points = {0};
    mesh.splats = std::make_shared<const SplatCloud>(cloud);
    Camera away = cameraFrom({0, 0, 3}, 21, 21);
    away.position.z = -3;
    const std::vector<Camera> cameras = {cameraFrom({0, 0, 3}, 21, 21), away};
    for (const bool one : {true, false}) {
        Job job;
        const auto bundle =
            one ? captureBundle(mesh, cameras, {}, job) : captureBundle(mesh, {away}, {}, job);
        ASSERT_FALSE(bundle);
        EXPECT_EQ(bundle.error().message.find("so that no view has depth") != std::string::npos,
                  one);
        EXPECT_EQ(job.takeNotes().back(),
                  fmt::format("view {} sees nothing of the model and was left out", one ? 1 : 0));
    }
}

TEST(DrawSplats, HugeSplatsStayWithinTheMemoryLimit) {
    SplatCloud cloud = randomCloud(20000, 0, 3);
    for (auto& s : cloud.scales) s = glm::vec3(1e14f, 1e14f, 1e-12f);
    for (auto& q : cloud.rotations) q = glm::vec4(0, 0, 0, 1);
    Job job;
    job.limits.maxMemoryBytes = 16 << 20;
    const auto drawn = drawSplats(cloud, cameraFrom({0, 0, 3}, 512, 512), false, job);
    ASSERT_FALSE(drawn);
    EXPECT_EQ(drawn.error().code, ErrorCode::invalidInput);
}

}  // namespace
}  // namespace stx
