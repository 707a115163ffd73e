// A ball from coarse views against the mesh itself: no quality leaves out what another
// covers.
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "lib/capture/capture.hpp"
#include "lib/geometry/view_layout.hpp"
#include "lib/render/mesh/mesh_renderer.hpp"
#include "lib/render/renderer.hpp"

namespace stx {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// A UV sphere of 24 x 48.
Mesh ball() {
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

class CoarseViews : public testing::TestWithParam<Coarse> {};

TEST_P(CoarseViews, AreDrawnWhole) {
    const Coarse& c = GetParam();
    const Mesh mesh = ball();
    Job job;
    const auto views =
        layoutCameras(*parseViewLayout(c.views),
                      {.width = c.side, .height = c.side, .fovRad = 35 * kDegree}, mesh.positions);
    ASSERT_TRUE(views);
    const auto bundle = captureBundle(mesh, *views, {}, job);
    ASSERT_TRUE(bundle);
    const double fov = 40 * kDegree, up = 15 * kDegree;
    const glm::dvec3 direction(0, std::sin(up), std::cos(up));
    const Bounds bounds = mesh.bounds();
    const glm::dvec3 eye =
        bounds.centre() + direction * (1.02 * bounds.radius() / std::sin(fov / 2));
    const Camera camera = Camera::fromFieldOfView(eye, *lookAt(eye, bounds.centre(), {0, 1, 0}),
                                                  {fov, fov}, false, 100, 100);
    const Frame truth = *makeMeshRenderer(mesh, {}, job)->render(camera);
    for (const Quality quality : {Quality::draft, Quality::normal, Quality::best}) {
        RenderSettings settings;
        settings.quality = quality;
        const auto renderer = makeRenderer(Backend::cpu, *bundle, settings, -1, job);
        ASSERT_TRUE(renderer);
        const auto frame = (*renderer)->render(camera);
        ASSERT_TRUE(frame);
        int solid = 0, open = 0;
        for (std::size_t i = 0; i < truth.colour.count(); ++i) {
            if (truth.colour.data()[i].a < 0.99f) continue;
            ++solid;
            open += frame->colour.data()[i].a < 0.5f;
        }
        EXPECT_LE(open, 0.001 * solid) << "quality " << static_cast<int>(quality);
    }
}

// Before tiles got the sources of their places 20 % was open in draft and 11 % in normal, then 12 %
// and 10 %.
INSTANTIATE_TEST_SUITE_P(Kinds, CoarseViews,
                         testing::Values(Coarse{"octahedral", "octahedral:4", 48},
                                         Coarse{"hemiOctahedral", "hemi-octahedral:4", 64}),
                         [](const auto& coarse) { return std::string(coarse.param.name); });

}  // namespace
}  // namespace stx
