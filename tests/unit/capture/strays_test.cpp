#include "lib/model/strays.hpp"

#include <gtest/gtest.h>

#include "lib/capture/capture.hpp"
#include "lib/capture/rasterizer.hpp"
#include "lib/geometry/depth_code.hpp"
#include "lib/geometry/view_layout.hpp"
#include "lib/model/splat_cloud.hpp"

namespace stx {
namespace {

/// `count` points on a unit sphere, evenly spread.
Mesh sphereCloud(int count) {
    Mesh mesh;
    ViewLayout layout;
    layout.count = count;
    for (const auto& d : layoutDirections(layout)) {
        mesh.points.push_back(static_cast<std::uint32_t>(mesh.positions.size()));
        mesh.positions.emplace_back(d);
    }
    mesh.materials.emplace_back();
    return mesh;
}

void addPoint(Mesh& mesh, glm::vec3 at) {
    mesh.points.push_back(static_cast<std::uint32_t>(mesh.positions.size()));
    mesh.positions.push_back(at);
}

// What is one pixel thin in a captured view is loose points beside its triangles.
TEST(Points, FewBesideFineTrianglesAreAsSmallAsThese) {
    Mesh mesh;
    constexpr std::uint32_t kSide = 101;
    constexpr float kStep = 0.01f;
    for (std::uint32_t y = 0; y < kSide; ++y)
        for (std::uint32_t x = 0; x < kSide; ++x)
            mesh.positions.emplace_back(static_cast<float>(x) * kStep,
                                        static_cast<float>(y) * kStep, 0);
    for (std::uint32_t y = 0; y + 1 < kSide; ++y) {
        for (std::uint32_t x = 0; x + 1 < kSide; ++x) {
            const std::uint32_t a = y * kSide + x, c = a + kSide;
            mesh.triangles.emplace_back(a, a + 1, c);
            mesh.triangles.emplace_back(a + 1, c + 1, c);
        }
    }
    for (const float x : {0.1f, 0.5f, 0.9f}) addPoint(mesh, {x, x, 0.2f});
    EXPECT_NEAR(loosePoints(mesh).radius, kStep, 1e-4);
    mesh.triangles.clear();
    EXPECT_GT(loosePoints(mesh).radius, 1.2f * kStep) << "alone they are larger";
}

// Views of discs, each of which faces its camera, would contradict each other.
TEST(Points, FewAreBalls) {
    Mesh mesh;
    for (const float x : {-1.0f, 0.0f, 1.0f}) addPoint(mesh, {x, 0.3f * x, 0});
    const float radius = loosePoints(mesh).radius;
    ViewLayout layout;
    layout.count = 6;
    ViewFraming framing;
    framing.width = framing.height = 256;
    const auto cameras = layoutCameras(layout, framing, drawnPoints(mesh));
    ASSERT_TRUE(cameras);
    Job job;
    const auto bundle = captureBundle(mesh, *cameras, {}, job);
    ASSERT_TRUE(bundle);
    int points = 0;
    for (const ReferenceView& view : bundle->views)
        for (int y = 0; y < view.camera.height; ++y)
            for (int x = 0; x < view.camera.width; ++x) {
                if (!hasPoint(view.depth.at(x, y))) continue;
                ++points;
                double nearest = 1e9;
                for (const glm::vec3 centre : mesh.positions)
                    nearest =
                        std::min(nearest, glm::distance(view.worldPoint(x, y), glm::dvec3(centre)));
                EXPECT_GT(nearest, 0.92 * radius) << x << ' ' << y;
                EXPECT_LT(nearest, 1.02 * radius) << x << ' ' << y;
            }
    EXPECT_GT(points, 300);
}

TEST(Strays, OnePointFarOffHidesNothing) {
    const Mesh clean = sphereCloud(20000);
    Mesh mesh = clean;
    addPoint(mesh, {3e5f, 2e5f, 0});
    EXPECT_LT(mesh.bounds().radius(), 2.0);
    EXPECT_NEAR(loosePoints(mesh).radius, loosePoints(clean).radius, 1e-3);
    ViewLayout layout;
    layout.count = 8;
    ViewFraming framing;
    framing.width = framing.height = 48;
    const auto cameras = layoutCameras(layout, framing, drawnPoints(mesh));
    const auto cleanCameras = layoutCameras(layout, framing, drawnPoints(clean));
    ASSERT_TRUE(cameras && cleanCameras);
    Job job;
    const auto bundle = captureBundle(mesh, *cameras, {}, job);
    ASSERT_TRUE(bundle) << bundle.error().text();
    ASSERT_EQ(bundle->views.size(), 8u);
    const auto expected = captureBundle(clean, *cleanCameras, {}, job);
    ASSERT_TRUE(expected);
    EXPECT_NEAR(static_cast<double>(bundle->pointCount()),
                static_cast<double>(expected->pointCount()), 0.02 * expected->pointCount());
    for (const auto& view : bundle->views)
        EXPECT_LT(view.farPlane - view.nearPlane, 2.0) << "the codes of the depth are the object's";
}

TEST(Strays, OneSplatFarOffIsInNoView) {
    // Behind the object, and so large that views show it beside the object.
    Mesh mesh = sphereCloud(2000);
    addPoint(mesh, {0, 6000, -10000});
    auto cloud = std::make_shared<SplatCloud>();
    ASSERT_TRUE(cloud->resize(mesh.positions.size(), 0, {}));
    cloud->positions = mesh.positions;
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
        cloud->scales[i] = glm::vec3(i < 2000 ? 0.05f : 2000.0f);
        cloud->rotations[i] = {0, 0, 0, 1};
        cloud->opacities[i] = 1;
    }
    mesh.splats = cloud;
    ViewLayout layout;
    layout.count = 8;
    ViewFraming framing;
    framing.width = framing.height = 48;
    const auto cameras = layoutCameras(layout, framing, drawnPoints(mesh));
    ASSERT_TRUE(cameras);
    Job job;
    const auto bundle = captureBundle(mesh, *cameras, {}, job);
    ASSERT_TRUE(bundle) << bundle.error().text();
    ASSERT_EQ(bundle->views.size(), 8u);
    for (const auto& view : bundle->views) EXPECT_LT(view.farPlane - view.nearPlane, 3.0);
    EXPECT_EQ(cloud->opacities.back(), 1) << "the cloud itself stays as it is";
    Job small;
    small.limits.maxMemoryBytes = 2001 * SplatCloud::bytesEach(0) - 1;
    const auto none = dropStrays(mesh, findStrays(mesh), small.limits);
    ASSERT_FALSE(none);
    EXPECT_EQ(none.error().code, ErrorCode::invalidInput);
}

TEST(Strays, ShapesHaveNone) {
    // A cube of 8 corners, a small thing on a wide floor, two clouds apart.
    Mesh cube;
    for (int k = 0; k < 8; ++k) addPoint(cube, {k & 1, k >> 1 & 1, (k >> 2 & 1) * 1000});
    EXPECT_TRUE(findStrays(cube).pieces.empty());
    Mesh floor = sphereCloud(20000);
    const auto base = static_cast<std::uint32_t>(floor.positions.size());
    floor.positions.insert(floor.positions.end(),
                           {{-500, -1, -500}, {500, -1, -500}, {500, -1, 500}, {-500, -1, 500}});
    floor.triangles = {{base, base + 1, base + 2}, {base, base + 2, base + 3}};
    floor.triangleMaterial = {0, 0};
    EXPECT_EQ(floor.bounds().max.x, 500);
    Mesh two = sphereCloud(20000);
    for (int i = 0; i < 200; ++i) addPoint(two, {1000 + i * 0.01f, 0, 0});
    EXPECT_TRUE(findStrays(two).pieces.empty()) << "one in a hundred is a part of the object";
    EXPECT_EQ(two.bounds().max.x, 1000 + 199 * 0.01f);
}

TEST(Strays, AreSaidWithTheirPlace) {
    Mesh mesh = sphereCloud(5000);
    addPoint(mesh, {0, 1000, 0});
    addPoint(mesh, {0, 5000, 0});
    const auto strays = findStrays(mesh);
    ASSERT_EQ(strays.pieces, (std::vector<std::uint64_t>{5000, 5001}));
    Job job;
    noteStrays(strays, 5002, "points", {0, 0, 7}, job);
    EXPECT_EQ(job.takeNotes(),
              std::vector<std::string>{"2 of 5002 points lie far outside of the rest (the farthest "
                                       "at 0 5000 7): bounds and reference views leave them out"});
    ASSERT_TRUE(dropStrays(mesh, strays, {}));
    EXPECT_EQ(mesh.points.size(), 5000u);
}

}  // namespace
}  // namespace stx
