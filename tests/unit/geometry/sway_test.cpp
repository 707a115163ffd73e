// Cameras that sway around a picture's pose.
#include <gtest/gtest.h>

#include "lib/geometry/sway.hpp"

namespace stx {
namespace {

Camera photo() {
    Camera c = Camera::fromFieldOfView({1, 2, 3}, quatFromAxisAngle({0.3, 1, 0.2, 0.8}), {1.1, 0.8},
                                       false, 120, 90);
    c.cx += 3;
    c.cy -= 2;
    return c;
}

glm::dvec3 seen(const Camera& camera, glm::dvec3 world) {
    return camera.project(glm::conjugate(camera.orientation) * (world - camera.position));
}

TEST(Sway, KeepsWhatIsAtTheDistanceInItsPlace) {
    const Camera from = photo();
    const auto cameras = swayCameras(from, 5, 0.06, 7);
    ASSERT_TRUE(cameras);
    ASSERT_EQ(cameras->size(), 7u);
    const glm::dvec3 target = from.position + 5.0 * from.forward();
    for (const Camera& camera : *cameras) {
        const glm::dvec3 at = seen(camera, target);
        EXPECT_NEAR(at.x, from.cx, 1e-9);
        EXPECT_NEAR(at.y, from.cy, 1e-9);
        Camera lens = camera;
        lens.position = from.position;
        lens.orientation = from.orientation;
        EXPECT_EQ(lens, from);
    }
}

TEST(Sway, IsAnEllipseInTheImagePlane) {
    const Camera from = photo();
    const auto cameras = swayCameras(from, 5, 0.06, 4);
    ASSERT_TRUE(cameras);
    // To the right, up, to the left, down.
    const glm::dvec3 expected[] = {{0.3, 0, 0}, {0, 0.15, 0}, {-0.3, 0, 0}, {0, -0.15, 0}};
    for (std::size_t i = 0; i < 4; ++i) {
        const glm::dvec3 moved =
            glm::conjugate(from.orientation) * ((*cameras)[i].position - from.position);
        EXPECT_LT(glm::length(moved - expected[i]), 1e-12) << i;
    }
}

TEST(Sway, WantsADistance) {
    EXPECT_FALSE(swayCameras(photo(), 0, 0.06, 4));
    EXPECT_FALSE(swayCameras(photo(), 5, 0, 4));
}

}  // namespace
}  // namespace stx
