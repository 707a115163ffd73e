#include <gtest/gtest.h>

#include "lib/render/splat/cpu/cpu_splat.hpp"
#include "lib/render/splat/plan.hpp"

namespace stx {
namespace {

/// A view of the plane z = -3 from the origin, of 64x64 pixels that are 0.064 apart there.
Bundle wallFromAfar() {
    ReferenceView view;
    view.camera = Camera::fromFieldOfView({0, 0, 0}, {1, 0, 0, 0}, {1.2, 1.2}, false, 64, 64);
    view.texture = Texture(Rgba8Image(64, 64, glm::u8vec4(90, 140, 200, 255)));
    view.depth = Image<float>(64, 64, 3.0f);
    view.nearPlane = 1;
    view.farPlane = 10;
    Bundle bundle;
    bundle.views.push_back(std::move(view));
    return bundle;
}

/// All pixels show the wall: no gap is left between splats.
void expectFull(const Camera& camera, SplatRule rule) {
    const Bundle bundle = wallFromAfar();
    RenderSettings settings;
    settings.mode = RenderMode::splat;
    settings.splat = rule;
    Job job;
    const auto frame = makeCpuSplatRenderer(bundle, settings, job)->render(camera);
    ASSERT_TRUE(frame) << frame.error().text();
    for (int y = 0; y < camera.height; ++y) {
        for (int x = 0; x < camera.width; ++x) {
            const float depth = frame->depth.at(x, y);
            ASSERT_TRUE(hasPoint(depth)) << x << " " << y;
            const glm::vec4 off =
                glm::abs(frame->colour.at(x, y) - glm::vec4(90, 140, 200, 255) / 255.0f);
            ASSERT_LT(std::max({off.r, off.g, off.b, off.a}), 1e-3f) << x << " " << y;
            // The paper's splats do not follow the surface.
            if (rule == SplatRule::paper) continue;
            const glm::dvec3 at =
                camera.position + camera.orientation * camera.unproject(x + 0.5, y + 0.5, depth);
            ASSERT_NEAR(at.z, -3, 1e-3) << x << " " << y;
        }
    }
}

/// Splats ended 256 pixels from their points: of 6400 pixels' spacing little was left.
TEST(SplatCloseUps, OrthographicOnesAreFull) {
    const glm::dvec3 eye(0.013, 0.02, -2.9);
    for (const glm::dvec3 target : {glm::dvec3(0.013, 0.02, -3), glm::dvec3(0.05, 0.03, -3)}) {
        const Camera camera =
            Camera::fromFieldOfView(eye, *lookAt(eye, target), {1e-3, 1e-3}, true, 100, 100);
        expectFull(camera, SplatRule::data);
        expectFull(camera, SplatRule::paper);
    }
}

/// The same of 900 pixels' spacing, in a picture whose half is 600 pixels wide.
TEST(SplatCloseUps, SplatsGrowWithThePicture) {
    const glm::dvec3 eye(0.01, 0.02, 0);
    expectFull(Camera::fromFieldOfView(eye, *lookAt(eye, {0.01, 0.02, -3}), {0.0285, 0.0285}, false,
                                       1200, 1200),
               SplatRule::data);
}

TEST(SplatCloseUps, HaveALargestSplat) {
    const auto largest = [](int width, int height, bool orthographic) {
        return splat::largestSplat(Camera::fromFieldOfView({0, 0, 0}, {1, 0, 0, 0}, {0.5, 0.5},
                                                           orthographic, width, height));
    };
    EXPECT_EQ(largest(64, 64, false), 256.0f);
    EXPECT_EQ(largest(512, 512, false), 256.0f);
    EXPECT_EQ(largest(400, 1000, false), 500.0f);
    EXPECT_GT(largest(64, 64, true), 1e30f);
}

}  // namespace
}  // namespace stx
