#include <cmath>

#include <gtest/gtest.h>
#include <glm/gtc/packing.hpp>

#include "lib/capture/capture.hpp"
#include "lib/splats/draw.hpp"
#include "lib/splats/from_bundle.hpp"
#include "lib/splats/merge.hpp"
#include "lib/splats/transform.hpp"
#include "tests/unit/splats/random_cloud.hpp"

namespace stx {
namespace {

/// A square of 2 x 2 in z = 0, of four colours, seen from +Z and, more coarsely, from the side.
Bundle squareBundle() {
    Mesh mesh;
    mesh.positions = {{-1, 1, 0}, {1, 1, 0}, {1, -1, 0}, {-1, -1, 0}};
    mesh.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    mesh.triangles = {{0, 2, 1}, {0, 3, 2}};
    mesh.triangleMaterial = {0, 0};
    mesh.materials.emplace_back();
    mesh.materials[0].baseColourTexture = 0;
    MeshTexture texture;
    texture.nearest = true;
    texture.pixels = Rgba8Image(2, 2, {250, 20, 20, 255});
    texture.pixels.at(1, 0) = {20, 250, 20, 255};
    texture.pixels.at(0, 1) = {20, 20, 250, 255};
    texture.pixels.at(1, 1) = {250, 250, 250, 255};
    mesh.textures = {texture};
    Job job;
    return *captureBundle(mesh, {cameraFrom({0, 0, 4}, 64, 64), cameraFrom({6, 0, 5}, 64, 64)}, {},
                          job);
}

TEST(SplatsOfBundle, LieFlatInTheSurface) {
    Job job;
    const auto cloud = splatsOfBundle(squareBundle(), {}, job);
    ASSERT_TRUE(cloud) << cloud.error().text();
    ASSERT_GT(cloud->positions.size(), 1000u);
    int tilted = 0;
    for (std::size_t i = 0; i < cloud->positions.size(); ++i) {
        EXPECT_NEAR(cloud->positions[i].z, 0.0f, 2e-4f);
        const glm::vec4 q = cloud->rotations[i];
        EXPECT_NEAR(glm::length(q), 1.0f, 1e-5f);
        const glm::vec3 normal = glm::mat3_cast(glm::quat(q.w, q.x, q.y, q.z))[2];
        tilted += std::abs(normal.z) < 0.99f ? 1 : 0;
        EXPECT_LT(cloud->scales[i].z, 0.1f * cloud->scales[i].x);
    }
    // Corners without a neighbour to both sides face their camera.
    EXPECT_LE(tilted, 8);
}

TEST(SplatsOfBundle, EachPlaceIsOfTheViewThatShowsItFinest) {
    Job job;
    Bundle bundle = squareBundle();
    const std::int64_t front = bundle.views[0].pointCount(), all = bundle.pointCount();
    const auto cloud = splatsOfBundle(std::move(bundle), {}, job);
    ASSERT_TRUE(cloud);
    EXPECT_LT(cloud->positions.size(), static_cast<std::size_t>(front + (all - front) / 4));
    EXPECT_GE(cloud->positions.size(), static_cast<std::size_t>(front));
}

TEST(SplatsOfBundle, ShowTheViewsAgain) {
    Job job;
    Bundle bundle = squareBundle();
    const auto cloud = splatsOfBundle(bundle, {}, job);
    ASSERT_TRUE(cloud);
    const ReferenceView& view = bundle.views[0];
    const auto drawn = drawSplats(*cloud, view.camera, false, job);
    ASSERT_TRUE(drawn);
    int inside = 0;
    for (int y = 1; y < 63; ++y) {
        for (int x = 1; x < 63; ++x) {
            // Within one colour.
            bool same = true;
            for (int k = 0; k < 9; ++k)
                same = same &&
                       view.texture.at(x + k % 3 - 1, y + k / 3 - 1) == view.texture.at(x, y) &&
                       hasPoint(view.depth.at(x + k % 3 - 1, y + k / 3 - 1));
            if (!same) continue;
            ++inside;
            const glm::vec4 c = drawn->colour.at(x, y);
            EXPECT_GT(c.w, 0.95f);
            for (int k = 0; k < 3; ++k) EXPECT_NEAR(c[k] / c.w, view.texture.at(x, y)[k], 0.08f);
            EXPECT_NEAR(drawn->depth.at(x, y), view.depth.at(x, y), 2e-3f);
        }
    }
    EXPECT_GT(inside, 500);
}

TEST(SplatsOfBundle, FlatPiecesOfOneColourMerge) {
    Job job;
    const auto cloud = splatsOfBundle(squareBundle(), {.most = 400}, job);
    ASSERT_TRUE(cloud) << cloud.error().text();
    EXPECT_LE(cloud->positions.size(), 400u);
    EXPECT_GT(cloud->positions.size(), 100u);
    // What is left still covers the square.
    const auto drawn = drawSplats(*cloud, cameraFrom({0, 0, 4}, 64, 64), false, job);
    const Bundle bundle = squareBundle();
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 64; ++x)
            EXPECT_TRUE(!hasPoint(bundle.views[0].depth.at(x, y)) ||
                        drawn->colour.at(x, y).w > 0.5f)
                << x << " " << y;
}

TEST(SplatsOfBundle, SaysHowFarPiecesMerge) {
    Job job;
    const auto cloud = splatsOfBundle(squareBundle(), {.most = 2}, job);
    ASSERT_FALSE(cloud);
    EXPECT_NE(cloud.error().message.find("at the least"), std::string::npos);
}

TEST(MergeDiscs, SharpEdgesStayApart) {
    Image<splats::Disc> image(8, 8);
    for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 8; ++x)
            image.at(x, y) = {{x, y, 0},
                              {0.7f, 0, 0},
                              {0, 0.7f, 0},
                              x < 3 ? glm::vec4(1, 0, 0, 1) : glm::vec4(0, 0, 1, 1)};
    const auto left = splats::mergeDiscs({image}, 30);
    ASSERT_LE(left[0].size(), 30u);
    for (const splats::Disc& d : left[0])
        EXPECT_TRUE(d.colour == glm::vec4(1, 0, 0, 1) || d.colour == glm::vec4(0, 0, 1, 1));
}

TEST(TransformSplats, ATurnedCloudSeenByATurnedCameraIsTheSame) {
    const SplatCloud cloud = randomCloud(500, 3, 4);
    SplatCloud turned = cloud;
    const glm::dquat q = glm::normalize(glm::dquat(0.3, 0.5, -0.2, 0.7));
    const glm::dvec3 shift(3, -1, 2);
    const double scale = 1.5;
    glm::dmat4 world(glm::mat3_cast(q) * scale);
    world[3] = glm::dvec4(shift, 1);
    transformSplats(turned, 0, world);
    Camera camera = cameraFrom({1, 1, 3}, 96, 96), other = camera;
    other.position = shift + q * (camera.position * scale);
    other.orientation = q * camera.orientation;
    Job job;
    const auto a = drawSplats(cloud, camera, false, job), b = drawSplats(turned, other, false, job);
    for (std::size_t i = 0; i < a->colour.count(); ++i)
        for (int k = 0; k < 4; ++k)
            EXPECT_NEAR(a->colour.pixels()[i][k], b->colour.pixels()[i][k], 0.01f);
}

TEST(TransformSplats, AStretchedSplatHasTheAxesOfItsCovariance) {
    SplatCloud cloud = randomCloud(1, 0, 5);
    const auto covariance = [&] {
        const glm::vec4 q = cloud.rotations[0];
        glm::dmat3 m(glm::mat3_cast(glm::quat(q.w, q.x, q.y, q.z)));
        for (int k = 0; k < 3; ++k) m[k] *= static_cast<double>(cloud.scales[0][k]);
        return m * glm::transpose(m);
    };
    const glm::dmat3 before = covariance(), stretch(2, 0, 0, 0.3, 1, 0, 0, 0, -0.5);
    transformSplats(cloud, 0, glm::dmat4(stretch));
    const glm::dmat3 wanted = stretch * before * glm::transpose(stretch), found = covariance();
    for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r) EXPECT_NEAR(found[c][r], wanted[c][r], 1e-6);
}

TEST(SplatCloud, WhatCannotBeDrawnIsLeftOutAndCounted) {
    SplatCloud cloud = randomCloud(6, 1, 6);
    const glm::vec3 last = cloud.positions[5];
    cloud.positions[0].x = NAN;
    cloud.scales[1].y = std::exp(80.0f);
    cloud.rotations[2] = glm::vec4(0.0f);
    cloud.opacities[3] = NAN;
    cloud.setHarmonic(4, 2, 1, INFINITY);
    Job job;
    ASSERT_TRUE(cloud.dropBroken(job));
    ASSERT_EQ(cloud.positions.size(), 1u);
    EXPECT_EQ(cloud.positions[0], last);
    EXPECT_EQ(job.takeNotes().at(0).substr(0, 27), "5 of 6 splats left out: a v");
    cloud.opacities[0] = -1;
    EXPECT_FALSE(cloud.dropBroken(job));
}

}  // namespace
}  // namespace stx
