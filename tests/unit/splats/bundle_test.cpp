#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/packing.hpp>

#include "lib/capture/capture.hpp"
#include "lib/splats/draw.hpp"
#include "lib/splats/from_bundle.hpp"
#include "lib/splats/merge.hpp"
#include "lib/splats/transform.hpp"
#include "lib/surface/normals.hpp"
#include "tests/torus_bundle.hpp"
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
    const auto cloud = splatsOfViews(*viewsOf(squareBundle()), {}, nullptr, job);
    ASSERT_TRUE(cloud) << cloud.error().text();
    ASSERT_GT(cloud->positions.size(), 1000u);
    const auto side = squareBundle().views[0].camera.sampleSpacing(4.0).x;
    const auto below = static_cast<float>(side * 1.2 / 1.5);
    int tilted = 0;
    for (std::size_t i = 0; i < cloud->positions.size(); ++i) {
        // Below it by 1.2 pixels of the front view, as pictures of 1.5 pixels a texel want it; the
        // view from the side has larger texels.
        EXPECT_LT(cloud->positions[i].z, -0.95f * below);
        EXPECT_GT(cloud->positions[i].z, -2.3f * below);
        const glm::vec4 q = cloud->rotations[i];
        EXPECT_NEAR(glm::length(q), 1.0f, 1e-5f);
        const glm::vec3 normal = glm::mat3_cast(glm::quat(q.w, q.x, q.y, q.z))[2];
        tilted += std::abs(normal.z) < 0.99f ? 1 : 0;
        EXPECT_LT(cloud->scales[i].z, 0.1f * cloud->scales[i].x);
    }
    // Corners without a neighbour to both sides face their camera.
    EXPECT_LE(tilted, 8);
}

TEST(SplatsOfBundle, SayThatColoursBeyondWhiteAreClipped) {
    for (const float bright : {1.0f, 4.0f}) {
        Bundle bundle = squareBundle();
        const glm::ivec2 size = bundle.views[0].depth.size();
        RgbaFloatImage colour(size.x, size.y, glm::vec4(0.5f, 0.5f, 0.5f, 1.0f));
        colour.at(size.x / 2, size.y / 2).g = bright;
        bundle.views.resize(1);
        bundle.views[0].texture = Texture(std::move(colour));
        Job job;
        ASSERT_TRUE(splatsOfViews(*viewsOf(bundle), {}, nullptr, job));
        EXPECT_EQ(std::ranges::count(job.takeNotes(),
                                     "linear colour becomes sRGB; values above 1 are clipped"),
                  bright > 1 ? 1 : 0);
    }
}

TEST(SplatsOfBundle, EachPlaceIsOfTheViewThatShowsItFinest) {
    Job job;
    Bundle bundle = squareBundle();
    const std::int64_t front = bundle.views[0].pointCount(), all = bundle.pointCount();
    const auto cloud = splatsOfViews(*viewsOf(bundle), {}, nullptr, job);
    ASSERT_TRUE(cloud);
    EXPECT_LT(cloud->positions.size(), static_cast<std::size_t>(front + (all - front) / 4));
    EXPECT_GE(cloud->positions.size(), static_cast<std::size_t>(front));
}

/// Room for pixels, counted.
class CountedRoom final : public PixelSpool {
  public:
    void* take(std::size_t bytes) override {
        taken += bytes;
        return std::malloc(bytes);
    }
    void give(void* room, std::size_t /*bytes*/) noexcept override { std::free(room); }
    void settle() noexcept override {}
    std::atomic<std::size_t> taken = 0;
};

TEST(SplatsOfBundle, AreTheSameFromASpool) {
    Bundle bundle = torusViews(48);
    bundle.views[3].background = bundle.views[7].background = true;
    bundle.origin = {10, 20, 30};
    for (const bool axes : {false, true}) {
        Job job;
        if (axes) {
            ASSERT_TRUE(bake(bundle, {}, job));
        }
        std::size_t most = 0;
        for (const bool merged : {false, true}) {
            const SplatSettings settings{.most = most};
            const auto expected = splatsOfViews(*viewsOf(bundle), settings, nullptr, job);
            ASSERT_TRUE(expected) << expected.error().text();
            if (merged) {
                // Hardly two squares lose the same.
                EXPECT_LE(expected->positions.size(), most);
                EXPECT_GT(expected->positions.size() + 6, most);
            }
            most = expected->positions.size() * 3 / 4;
            const auto table = viewsOf(bundle);
            CountedRoom room;
            const auto spooled = splatsOfViews(*table, settings, &room, job);
            ASSERT_TRUE(spooled) << spooled.error().text();
            EXPECT_EQ(*spooled, *expected);
            EXPECT_GE(room.taken, 52 * bundle.views.size() * bundle.views[0].depth.count());
        }
    }
}

TEST(SplatsOfBundle, ShowTheViewsAgain) {
    Job job;
    Bundle bundle = squareBundle();
    const auto cloud = splatsOfViews(*viewsOf(bundle), {}, nullptr, job);
    ASSERT_TRUE(cloud);
    const ReferenceView& view = bundle.views[0];
    const auto below = static_cast<float>(view.camera.sampleSpacing(4.0).x * 1.2 / 1.5);
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
            EXPECT_NEAR(drawn->depth.at(x, y), view.depth.at(x, y) + below, 2e-3f);
        }
    }
    EXPECT_GT(inside, 500);
}

/// A white ball of radius 1, seen from ten sides.
Bundle ballBundle() {
    constexpr int kRows = 64, kColumns = 128;
    Mesh mesh;
    for (int i = 0; i <= kRows; ++i)
        for (int j = 0; j <= kColumns; ++j) {
            const double down = std::numbers::pi * i / kRows,
                         around = 2 * std::numbers::pi * j / kColumns;
            mesh.positions.emplace_back(std::sin(down) * std::sin(around), std::cos(down),
                                        std::sin(down) * std::cos(around));
        }
    for (int i = 0; i < kRows; ++i)
        for (int j = 0; j < kColumns; ++j) {
            const auto at = static_cast<std::uint32_t>(i * (kColumns + 1) + j);
            mesh.triangles.emplace_back(at, at + kColumns + 1, at + 1);
            mesh.triangles.emplace_back(at + 1, at + kColumns + 1, at + kColumns + 2);
        }
    mesh.triangleMaterial.assign(mesh.triangles.size(), 0);
    mesh.materials.emplace_back();
    std::vector<Camera> cameras;
    for (int k = 0; k < 8; ++k) {
        const double around = std::numbers::pi / 4 * k;
        cameras.push_back(
            cameraFrom({4 * std::sin(around), k % 2 ? 1 : -1, 4 * std::cos(around)}, 64, 64));
    }
    cameras.push_back(cameraFrom({0.1, 4, 0}, 64, 64));
    cameras.push_back(cameraFrom({0.1, -4, 0}, 64, 64));
    Job job;
    return *captureBundle(mesh, cameras, {}, job);
}

/// How much of a picture what was drawn covers.
double covered(const Image<glm::vec4>& colour) {
    double sum = 0;
    for (const glm::vec4& c : colour.pixels()) sum += static_cast<double>(c.w);
    return sum;
}

TEST(SplatsOfBundle, OutlinesDoNotGrow) {
    const Bundle bundle = ballBundle();
    for (const int size : {64, 96, 128}) {
        Job job;
        SplatSettings settings;
        settings.pixelsPerTexel = size / 64.0;
        const auto cloud = splatsOfViews(*viewsOf(bundle), settings, nullptr, job);
        ASSERT_TRUE(cloud);
        const auto drawn = drawSplats(*cloud, cameraFrom({2, 1, 3.3}, size, size), false, job);
        ASSERT_TRUE(drawn);
        // Its outline is a circle: the sine of its half angle is 1 / distance.
        const double distance = std::sqrt(4 + 1 + 3.3 * 3.3);
        const double radius = size / 2.0 / std::tan(0.4) / std::sqrt(distance * distance - 1);
        const double off = std::sqrt(covered(drawn->colour) / std::numbers::pi) - radius;
        // 1.3 pixels, if the splats were at the surface.
        EXPECT_LT(off, 0.7) << "at " << size;
        EXPECT_GT(off, 0.0) << "at " << size;
    }
}

TEST(SplatsOfBundle, FlatPiecesOfOneColourMerge) {
    Job job;
    const auto cloud = splatsOfViews(*viewsOf(squareBundle()), {.most = 400}, nullptr, job);
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
    const auto cloud = splatsOfViews(*viewsOf(squareBundle()), {.most = 2}, nullptr, job);
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
    const splats::DiscMerging merging({&image, 1}, 30);
    std::vector<splats::Disc> left;
    merging.left(image, [&](const auto& row) { left.insert(left.end(), row.begin(), row.end()); });
    EXPECT_EQ(left.size(), merging.count());
    ASSERT_LE(left.size(), 30u);
    for (const splats::Disc& d : left)
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

TEST(TransformSplats, AMirroredCloudIsTheMirroredPicture) {
    const SplatCloud cloud = randomCloud(500, 3, 4);
    for (const glm::dvec3 scale : {glm::dvec3(-1, 1, 1), glm::dvec3(-1, -1, -1)}) {
        SplatCloud mirrored = cloud;
        transformSplats(mirrored, 0, glm::scale(glm::dmat4(1), scale));
        const glm::dvec3 place(1, 1, 3);
        Job job;
        // Both upright, so that x of the second picture runs from right to left; that of the
        // inversion is turned by half.
        const auto a = drawSplats(cloud, cameraFrom(place, 96, 96), false, job),
                   b = drawSplats(mirrored, cameraFrom(scale * place, 96, 96), false, job);
        for (int y = 0; y < 96; ++y)
            for (int x = 0; x < 96; ++x)
                for (int k = 0; k < 4; ++k)
                    EXPECT_NEAR(a->colour.at(x, y)[k],
                                b->colour.at(scale.y < 0 ? x : 95 - x, scale.y < 0 ? 95 - y : y)[k],
                                0.01f);
    }
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
