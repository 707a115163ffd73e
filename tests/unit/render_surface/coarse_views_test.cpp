// A ball from coarse views against the mesh itself: no quality leaves out what another covers, and
// close by surfaces are as good as splats.
#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "lib/capture/capture.hpp"
#include "lib/geometry/view_layout.hpp"
#include "lib/render/factory.hpp"
#include "lib/render/mesh/mesh_renderer.hpp"
#include "lib/render/surface/prepare/source.hpp"
#include "tests/noisy_depth.hpp"

namespace stx {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// A UV sphere of 24 x 48.
Mesh ballMesh() {
    constexpr int kAround = 48, kUp = 24;
    Mesh mesh;
    mesh.materials.emplace_back();
    for (int i = 0; i <= kAround; ++i) {
        for (int j = 0; j <= kUp; ++j) {
            const double a = 2 * std::numbers::pi * i / kAround;
            const double b = std::numbers::pi * (static_cast<double>(j) / kUp - 0.5);
            mesh.positions.emplace_back(std::cos(b) * std::cos(a), std::sin(b),
                                        -std::cos(b) * std::sin(a));
            mesh.colours.emplace_back(0.5 + 0.4 * std::sin(3 * a), 0.5 + 0.4 * std::sin(5 * b),
                                      0.5 + 0.4 * std::cos(2 * a + 3 * b), 1);
        }
    }
    for (int i = 0; i < kAround; ++i) {
        for (int j = 0; j < kUp; ++j) {
            const int k = i * (kUp + 1) + j, next = k + kUp + 1;
            mesh.triangles.emplace_back(k, k + 1, next + 1);
            mesh.triangles.emplace_back(k, next + 1, next);
        }
    }
    mesh.triangleMaterial.assign(mesh.triangles.size(), 0);
    return mesh;
}

struct Coarse {
    const char *name, *views;
    int side;
};

Bundle viewsOf(const Mesh& mesh, const char* views, int side, bool orthographic) {
    Job job;
    const auto cameras = layoutCameras(
        *parseViewLayout(views),
        {.width = side, .height = side, .orthographic = orthographic, .fovRad = 35 * kDegree},
        mesh.positions);
    EXPECT_TRUE(cameras);
    auto bundle = captureBundle(mesh, *cameras, {}, job);
    EXPECT_TRUE(bundle);
    return std::move(*bundle);
}

/// From where a field of view of 40 degrees holds the ball.
Camera cameraAt(const Mesh& mesh, double fovDegrees, int side, double elevationDegrees = 15) {
    const double fov = fovDegrees * kDegree, up = elevationDegrees * kDegree;
    const Bounds bounds = mesh.bounds();
    const glm::dvec3 eye = bounds.centre() + glm::dvec3(0, std::sin(up), std::cos(up)) *
                                                 (1.02 * bounds.radius() / std::sin(20 * kDegree));
    return Camera::fromFieldOfView(eye, *lookAt(eye, bounds.centre(), {0, 1, 0}), {fov, fov}, false,
                                   side, side);
}

/// The share of what the truth covers that a frame leaves open.
double openShare(const Frame& frame, const Frame& truth) {
    int solid = 0, open = 0;
    for (std::size_t i = 0; i < truth.colour.count(); ++i) {
        if (truth.colour.data()[i].a < 0.99f) continue;
        ++solid;
        open += frame.colour.data()[i].a < 0.5f;
    }
    return static_cast<double>(open) / solid;
}

class CoarseViews : public testing::TestWithParam<Coarse> {};

TEST_P(CoarseViews, AreDrawnWhole) {
    const Coarse& c = GetParam();
    const Mesh mesh = ballMesh();
    Job job;
    const Bundle bundle = viewsOf(mesh, c.views, c.side, false);
    const Camera camera = cameraAt(mesh, 40, 100);
    const Frame truth = *makeMeshRenderer(mesh, {}, job)->render(camera);
    for (const Quality quality : {Quality::normal, Quality::best}) {
        RenderSettings settings;
        settings.quality = quality;
        const auto renderer = makeRenderer(Backend::cpu, bundle, settings, -1, job);
        ASSERT_TRUE(renderer);
        const auto frame = (*renderer)->render(camera);
        ASSERT_TRUE(frame);
        EXPECT_LE(openShare(*frame, truth), 0.001) << "quality " << static_cast<int>(quality);
    }
}

// Before tiles got the sources of their places 11 and 10 % was open.
INSTANTIATE_TEST_SUITE_P(Kinds, CoarseViews,
                         testing::Values(Coarse{"octahedral", "octahedral:4", 48},
                                         Coarse{"hemiOctahedral", "hemi-octahedral:4", 64}),
                         [](const auto& coarse) { return std::string(coarse.param.name); });

/// A box whose sides are 1.
Mesh boxMesh() {
    Mesh mesh;
    mesh.materials.emplace_back();
    for (int axis = 0; axis < 3; ++axis) {
        for (const float side : {-0.5f, 0.5f}) {
            const int first = static_cast<int>(mesh.positions.size());
            for (int corner = 0; corner < 4; ++corner) {
                glm::vec3 at;
                at[axis] = side;
                at[(axis + 1) % 3] = ((corner & 1) != 0) == (side > 0) ? 0.5f : -0.5f;
                at[(axis + 2) % 3] = (corner & 2) ? 0.5f : -0.5f;
                mesh.positions.push_back(at);
                mesh.colours.emplace_back(0.7, 0.7, 0.7, 1);
            }
            mesh.triangles.emplace_back(first, first + 1, first + 3);
            mesh.triangles.emplace_back(first, first + 3, first + 2);
        }
    }
    mesh.triangleMaterial.assign(mesh.triangles.size(), 0);
    return mesh;
}

// The middle of a tile in which an object ends is outside the views that show that end, where they
// are as large as the object. Tiles were built from others then: 0.04 % was open.
TEST(CoarseViews, OutlinesAreDrawnFromViewsThatEndThere) {
    const Mesh mesh = boxMesh();
    const BoundingSphere sphere = boundingSphere(mesh.positions);
    std::vector<Camera> cameras;
    for (int axis = 0; axis < 3; ++axis) {
        for (const double side : {-1.0, 1.0}) {
            for (const double turn : {-0.1, 0.1}) {
                glm::dvec3 direction;
                direction[axis] = side;
                direction[(axis + 1) % 3] = turn;
                direction[(axis + 2) % 3] = 0.5 * turn;
                const auto camera = frameCamera(direction, {.width = 192, .height = 192},
                                                mesh.positions, sphere, true);
                ASSERT_TRUE(camera);
                cameras.push_back(*camera);
            }
        }
    }
    Job job;
    const auto bundle = captureBundle(mesh, cameras, {}, job);
    ASSERT_TRUE(bundle);
    const auto renderer = makeRenderer(Backend::cpu, *bundle, {}, -1, job);
    ASSERT_TRUE(renderer);
    const Camera camera = cameraAt(mesh, 40, 300, 20);
    const auto frame = (*renderer)->render(camera);
    const auto truth = makeMeshRenderer(mesh, {}, job)->render(camera);
    ASSERT_TRUE(frame && truth);
    EXPECT_LE(openShare(*frame, *truth), 0.0001);
}

// Where links were shares of the distance for any size of pixels, a third of these were none.
TEST(CoarseViews, OneSurfaceIsLinked) {
    const Bundle bundle = viewsOf(ballMesh(), "ring:3", 32, false);
    const PageSet set(bundle);
    const surface::SurfaceScene scene(set);
    const surface::Source& s = scene.sources[0];
    int pairs = 0, linked = 0;
    for (int y = 0; y < s.height; ++y) {
        for (int x = 0; x + 1 < s.width; ++x) {
            // Within 60 degrees of the middle of the ball, whose radius is some 14 pixels.
            if (std::hypot(x + 1.0 - 16, y + 0.5 - 16) > 12) continue;
            ++pairs;
            linked += s.infoAt(s.placeOf(x, y), 0, 0) & surface::Info::kLinkRight ? 1 : 0;
        }
    }
    EXPECT_EQ(linked, pairs);
}

// An orthographic camera has pixels for what is behind it, too, but does not see that.
TEST(CoarseViews, WhatIsBehindAnOrthographicCameraIsNotFree) {
    const Mesh mesh = ballMesh();
    Bundle bundle = viewsOf(mesh, "ring:3", 48, true);
    const Camera camera = cameraAt(mesh, 40, 100);
    const auto draw = [&] {
        Job job;
        const auto renderer = makeRenderer(Backend::cpu, bundle, {}, -1, job);
        EXPECT_TRUE(renderer);
        return *(*renderer)->render(camera);
    };
    const Frame before = draw();
    // It turns its back to the ball and sees nothing.
    ReferenceView away = bundle.views[0];
    away.name = "away";
    away.camera.orientation = away.camera.orientation * glm::dquat(0, 0, 1, 0);
    std::ranges::fill(away.depth.pixels(), kNoDepth);
    std::ranges::fill(away.texture.rgba8()->pixels(), glm::u8vec4(0));
    bundle.views.push_back(std::move(away));
    EXPECT_EQ(draw().colour, before.colour);
}

/// Mean squared difference of the colours of two frames.
double difference(const Frame& a, const Frame& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.colour.count(); ++i) {
        const glm::dvec3 d(glm::vec3(a.colour.data()[i]) - glm::vec3(b.colour.data()[i]));
        sum += glm::dot(d, d);
    }
    return sum / static_cast<double>(a.colour.count());
}

void addBox(Mesh& mesh, glm::vec3 centre, glm::vec3 half, glm::vec3 colour) {
    const auto at = static_cast<int>(mesh.positions.size());
    for (int corner = 0; corner < 8; ++corner) {
        const glm::vec3 sign(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
        mesh.positions.push_back(centre + half * sign);
        mesh.colours.emplace_back(colour, 1);
    }
    for (const auto& face :
         {glm::ivec4(0, 2, 3, 1), glm::ivec4(4, 5, 7, 6), glm::ivec4(0, 1, 5, 4),
          glm::ivec4(2, 6, 7, 3), glm::ivec4(0, 4, 6, 2), glm::ivec4(1, 3, 7, 5)}) {
        mesh.triangles.emplace_back(at + face.x, at + face.y, at + face.z);
        mesh.triangles.emplace_back(at + face.x, at + face.z, at + face.w);
    }
    mesh.triangleMaterial.assign(mesh.triangles.size(), 0);
}

/// Three bars that cross, along the axes.
Mesh crossOf(float thick) {
    Mesh mesh;
    mesh.materials.emplace_back();
    for (int along = 0; along < 3; ++along) {
        glm::vec3 half(thick / 2);
        half[along] = 1;
        addBox(mesh, glm::vec3(0), half, {0.2f + 0.3f * static_cast<float>(along), 0.5f, 0.6f});
    }
    return mesh;
}

// Four of the six views see each face edge on. Before what is behind it was asked about, they voted
// most of the bars away wherever their outlines lay on the far side of a pixel's middle.
TEST(CoarseViews, FacesSeenEdgeOnAreNoFreeSpace) {
    const glm::dvec3 eye = glm::dvec3(0.45, 0.4, 0.8) * 5.0;
    const Camera camera = Camera::fromFieldOfView(eye, *lookAt(eye, {0, 0, 0}, {0, 1, 0}),
                                                  {0.5, 0.5}, false, 120, 120);
    Job job;
    for (const float thick : {0.12f, 0.172f, 0.2f, 0.25f}) {
        const Mesh mesh = crossOf(thick);
        const Frame truth = *makeMeshRenderer(mesh, {}, job)->render(camera);
        for (const int side : {48, 67, 80}) {
            const Bundle bundle = viewsOf(mesh, "cube", side, true);
            const auto frame = (*makeRenderer(Backend::cpu, bundle, {}, -1, job))->render(camera);
            ASSERT_TRUE(frame);
            EXPECT_LE(openShare(*frame, truth), 0.03) << thick << " thick, views of " << side;
        }
    }
}

// Its depth changes by some six pixels' sizes from row to row. Not linked each pixel was drawn
// alone.
TEST(CoarseViews, AFaceSeenAtAGrazingAngleIsOneSurface) {
    Mesh mesh;
    mesh.materials.emplace_back();
    addBox(mesh, glm::vec3(0), {1, 0.01f, 1}, glm::vec3(0.5f));
    const glm::dvec3 eye(0, 0.65, 4);
    const Camera camera =
        Camera::fromFieldOfView(eye, *lookAt(eye, {0, 0, 0}, {0, 1, 0}), {0.7, 0.7}, false, 64, 64);
    Job job;
    const auto bundle = captureBundle(mesh, {camera}, {}, job);
    ASSERT_TRUE(bundle);
    const PageSet set(*bundle);
    const surface::SurfaceScene scene(set);
    const surface::Source& s = scene.sources[0];
    int pairs = 0, linked = 0;
    for (int y = 0; y + 1 < s.height; ++y) {
        for (int x = 0; x < s.width; ++x) {
            if (!(s.q(x, y) > 0) || !(s.q(x, y + 1) > 0)) continue;
            ++pairs;
            linked += s.infoAt(s.placeOf(x, y), 0, 0) & surface::Info::kLinkDown ? 1 : 0;
        }
    }
    EXPECT_GT(pairs, 150);
    // Its lower edge is a row of others.
    EXPECT_GE(linked, 0.8 * pairs);
}

// Of the faces that meet at an edge of a box each is shown by one view, whose outermost pixels end
// up to half a pixel before it. Behind the gap is what the same view shows of the other box.
TEST(CoarseViews, FacesThatViewsShowOneByOneMeet) {
    Mesh mesh;
    mesh.materials.emplace_back();
    addBox(mesh, glm::vec3(0), glm::vec3(0.5f), {0.9f, 0.8f, 0.1f});
    addBox(mesh, {-1.3f, 0, -1.3f}, glm::vec3(0.5f, 1, 0.5f), {0.1f, 0.1f, 0.9f});
    const glm::dvec3 eye(4, 0.3, 4.5), at(0.5, 0, 0.5);
    const Camera camera =
        Camera::fromFieldOfView(eye, *lookAt(eye, at, {0, 1, 0}), {0.1, 0.1}, false, 120, 120);
    Job job;
    const Frame truth = *makeMeshRenderer(mesh, {}, job)->render(camera);
    for (const int side : {90, 101, 118, 125}) {
        const auto frame =
            (*makeRenderer(Backend::cpu, viewsOf(mesh, "cube", side, false), {}, -1, job))
                ->render(camera);
        ASSERT_TRUE(frame);
        int blue = 0;
        for (std::size_t i = 0; i < truth.colour.count(); ++i)
            blue += truth.colour.data()[i].r > 0.8f && frame->colour.data()[i].r < 0.5f;
        EXPECT_EQ(blue, 0) << "views of " << side;
    }
}

// The views of the horizon see the face edge on, and noise puts it in front of what they see.
// Before that was allowed for they voted its border away.
TEST(CoarseViews, ANoisyFaceKeepsItsBorder) {
    Mesh mesh;
    mesh.materials.emplace_back();
    addBox(mesh, glm::vec3(0), {1, 0.05f, 1}, glm::vec3(0.5f));
    Bundle bundle = viewsOf(mesh, "hemi-octahedral:3", 70, false);
    noisy::addNoise(bundle, 0.002);
    const Camera camera = cameraAt(mesh, 40, 100, 50);
    Job job;
    const Frame truth = *makeMeshRenderer(mesh, {}, job)->render(camera);
    RenderSettings settings;
    settings.fill = Fill::none;
    const auto frame = (*makeRenderer(Backend::cpu, bundle, settings, -1, job))->render(camera);
    ASSERT_TRUE(frame);
    EXPECT_LE(openShare(*frame, truth), 0.02);
}

struct Close {
    const char* views;
    int side;
    double elevation, fov;  ///< degrees
};

/// With the size of one pixel of the frame alone each tap made a facet: 16 dB below splats. The
/// second: what the views of the horizon extend at their outlines lies before the ball's top,
/// which the others show.
TEST(CloserThanTheReferences, SurfacesAreAsSmoothAsSplats) {
    const Mesh mesh = ballMesh();
    Job job;
    for (const Close& c :
         {Close{"ring:6", 64, 15, 22}, {"hemi-octahedral:4", 30, 60, 9}, {"ring:6", 64, 15, 13}}) {
        const Bundle bundle = viewsOf(mesh, c.views, c.side, true);
        const Camera camera = cameraAt(mesh, c.fov, 200, c.elevation);
        const Frame truth = *makeMeshRenderer(mesh, {}, job)->render(camera);
        RenderSettings splat;
        splat.mode = RenderMode::splat;
        const auto splats = makeRenderer(Backend::cpu, bundle, splat, -1, job);
        ASSERT_TRUE(splats);
        const double ofSplats = difference(*(*splats)->render(camera), truth);
        for (const Quality quality : {Quality::normal, Quality::best}) {
            RenderSettings settings;
            settings.quality = quality;
            const auto surfaces = makeRenderer(Backend::cpu, bundle, settings, -1, job);
            ASSERT_TRUE(surfaces);
            const double ofSurfaces = difference(*(*surfaces)->render(camera), truth);
            // Half a decibel.
            EXPECT_LT(ofSurfaces, std::pow(10.0, 0.05) * ofSplats) << c.views << ' ' << c.fov;
        }
    }
}

}  // namespace
}  // namespace stx
