#include "lib/quality/capture_quality.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "lib/geometry/view_layout.hpp"

namespace stx {
namespace {

/// A ball of radius 1 of one material.
Mesh ballOf(const Material& material) {
    constexpr std::uint32_t kAround = 48, kDown = 24;
    Mesh mesh;
    for (std::uint32_t j = 0; j <= kDown; ++j) {
        for (std::uint32_t i = 0; i <= kAround; ++i) {
            const double down = std::numbers::pi * j / kDown,
                         around = 2 * std::numbers::pi * i / kAround;
            mesh.positions.emplace_back(std::sin(down) * std::sin(around), std::cos(down),
                                        std::sin(down) * std::cos(around));
        }
    }
    for (std::uint32_t j = 0; j < kDown; ++j) {
        for (std::uint32_t i = 0; i < kAround; ++i) {
            const std::uint32_t a = j * (kAround + 1) + i, b = a + kAround + 1;
            if (j > 0) mesh.triangles.emplace_back(a, b + 1, a + 1);
            if (j + 1 < kDown) mesh.triangles.emplace_back(a, b, b + 1);
        }
    }
    mesh.triangleMaterial.assign(mesh.triangles.size(), 0);
    mesh.materials = {material};
    return mesh;
}

Material reddish() {
    Material m;
    m.baseColour = {0.8f, 0.3f, 0.3f, 1.0f};
    m.doubleSided = false;
    return m;
}

/// What the six views of a cube's sides reach at most; 25 dB are asked for.
double reachedBy(const Material& material, const CaptureSettings& settings) {
    const Mesh mesh = ballOf(material);
    ViewLayout layout;
    layout.kind = ViewLayout::Kind::cube;
    layout.count = 6;
    ViewFraming framing;
    framing.width = framing.height = 64;
    const auto cameras = layoutCameras(layout, framing, mesh.positions);
    EXPECT_TRUE(cameras) << cameras.error().text();
    Job job;
    const auto fewest = fewestCameras(mesh, *cameras, settings, 25.0, job);
    EXPECT_TRUE(fewest) << fewest.error().text();
    return fewest ? fewest->psnr : 0;
}

TEST(FewestCameras, OfAnOpaqueBallReachAQuality) {
    EXPECT_GE(reachedBy(reddish(), {}), 25.0);
}

// Surface mode draws it opaque, however many views there are.
TEST(FewestCameras, OfGlassAreMeasuredAsViewsShowIt) {
    Material glass = reddish();
    glass.baseColour.a = 0.5f;
    glass.alpha = Material::Alpha::blend;
    EXPECT_GE(reachedBy(glass, {}), 25.0);
}

// The colour of such views is without it.
TEST(FewestCameras, AreMeasuredWithoutEmissionThatIsKeptApart) {
    Material lamp = reddish();
    lamp.emissive = {0.5f, 0.2f, 0.1f};
    CaptureSettings settings;
    EXPECT_GE(reachedBy(lamp, settings), 25.0);
    settings.materials = true;
    EXPECT_GE(reachedBy(lamp, settings), 25.0);
}

}  // namespace
}  // namespace stx
