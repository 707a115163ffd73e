#include "lib/geometry/camera.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "lib/geometry/depth_code.hpp"
#include "lib/geometry/view_layout.hpp"

namespace stx {
namespace {

TEST(Camera, ProjectsToTheStandardsPixelCentres) {
    // ISO/IEC 14496-16, 4.5.4: u = (i+1/2)/W*2-1, v = 1-(j+1/2)/H*2; point = R(u z tan(fx/2), v z
    // tan(fy/2), -z)+p.
    const auto c = Camera::fromFieldOfView({1, 2, 3}, quatFromAxisAngle({0, 1, 0, 0.3}), {0.8, 0.6},
                                           false, 64, 48);
    const int i = 5, j = 7;
    const double dist = 4.0;
    const double u = (i + 0.5) / 64 * 2 - 1, v = 1 - (j + 0.5) / 48 * 2;
    const glm::dvec3 expected(u * dist * std::tan(0.4), v * dist * std::tan(0.3), -dist);
    EXPECT_LT(glm::length(c.unproject(i + 0.5, j + 0.5, dist) - expected), 1e-12);
    const auto back = c.project(expected);
    EXPECT_NEAR(back.x, i + 0.5, 1e-9);
    EXPECT_NEAR(back.y, j + 0.5, 1e-9);
    EXPECT_NEAR(back.z, dist, 1e-12);
    EXPECT_NEAR(c.fieldOfView().x, 0.8, 1e-12);
}

TEST(Camera, OrthographicFieldOfViewIsTheWindow) {
    const auto c = Camera::fromFieldOfView({0, 0, 0}, {1, 0, 0, 0}, {4, 2}, true, 40, 20);
    const auto p = c.unproject(0.5, 0.5, 7);
    EXPECT_NEAR(p.x, -1.95, 1e-12);
    EXPECT_NEAR(p.y, 0.95, 1e-12);
    EXPECT_NEAR(c.project(p).x, 0.5, 1e-12);
}

TEST(Camera, LookAtPointsTheAxisAtTheTarget) {
    for (const glm::dvec3 eye :
         {glm::dvec3(0, 0, 5), glm::dvec3(3, -2, 1), glm::dvec3(0, 4, 0), glm::dvec3(0, -4, 0)}) {
        const auto q = lookAt(eye, {0, 0, 0});
        ASSERT_TRUE(q);
        EXPECT_LT(glm::length(*q * glm::dvec3(0, 0, -1) - glm::normalize(-eye)), 1e-12);
    }
    EXPECT_FALSE(lookAt({1, 1, 1}, {1, 1, 1}));
}

TEST(Camera, LookAtSaysWhyNot) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(lookAt({nan, 0, 1}, {0, 0, 0}).error().message,
              "the camera's eye is (nan,0,1); finite numbers are expected");
    EXPECT_EQ(lookAt({0, 0, 1}, {0, -INFINITY, 0}).error().message,
              "the camera's target is (0,-inf,0); finite numbers are expected");
    EXPECT_EQ(lookAt({1e300, 0, 1}, {0, 0, 0}).error().message,
              "the camera's eye (1e+300,0,1) and target (0,0,0) are too far apart; move one");
    EXPECT_EQ(lookAt({1, 2, 3}, {1, 2, 3}).error().message,
              "the camera's eye and target are the same point (1,2,3); move one");
}

TEST(Camera, AxisAngleRoundTrips) {
    for (const glm::dvec4 r :
         {glm::dvec4(0, 0, 1, 0), glm::dvec4(0.6, 0, 0.8, 1.2), glm::dvec4(0, 1, 0, 3.1),
          glm::dvec4(0, 1, 0, static_cast<float>(3.14159265358979))}) {
        const auto back = axisAngleFromQuat(quatFromAxisAngle(r));
        EXPECT_LT(glm::length(back - r), 1e-12);
    }
}

TEST(DepthCode, FollowsTheStandard) {
    const DepthCode code{10, 100, 255};
    EXPECT_EQ(code.decode(255), 10);
    EXPECT_EQ(code.decode(1), 100);
    EXPECT_FALSE(hasPoint(static_cast<float>(code.decode(0))));
    EXPECT_EQ(code.encode(1e9), 1u) << "a valid far point never becomes 'none'";
    EXPECT_EQ(code.encode(kNoDepth), 0u);
    EXPECT_NEAR(code.step() / 2, 0.177, 5e-4);
    for (std::uint32_t d = 1; d <= 255; ++d)
        EXPECT_EQ(code.encode(static_cast<float>(code.decode(d))), d);
    const DepthCode fine{0.7, 3.3, 65535};
    for (std::uint32_t d = 1; d <= 65535; ++d)
        EXPECT_EQ(fine.encode(static_cast<float>(fine.decode(d))), d);
}

/// Four cameras around an axis, level or tilted.
std::vector<Camera> around(glm::dvec3 up, double roll) {
    std::vector<Camera> cameras;
    ViewLayout ring;
    ring.kind = ViewLayout::Kind::ring;
    ring.count = 4;
    ring.elevationRad = 0.9;
    for (const auto& d : layoutDirections(ring)) {
        Camera c;
        c.orientation = *lookAt(rotationToUp(up) * d, glm::dvec3(0), up) *
                        glm::angleAxis(roll, glm::dvec3(0, 0, 1));
        cameras.push_back(c);
    }
    return cameras;
}

TEST(UpOfCameras, IsTheAxisTheyStandOn) {
    for (const glm::dvec3 up :
         {glm::dvec3(0, 1, 0), glm::dvec3(0, 0, 1), glm::dvec3(0, -1, 0), glm::dvec3(-1, 0, 0)}) {
        EXPECT_EQ(upOfCameras(around(up, 0.0)), up);
        EXPECT_EQ(upOfCameras(around(up, 0.1)), up);
    }
    EXPECT_EQ(upOfCameras({}), glm::dvec3(0, 1, 0));
    EXPECT_EQ(upOfCameras(around({1, 1, 1}, 0.0)), glm::dvec3(0, 1, 0));
}

TEST(RotationToUp, TakesTheFrontWithIt) {
    EXPECT_LT(glm::length(rotationToUp({0, 0, 3}) * glm::dvec3(0, 0, 1) - glm::dvec3(0, -1, 0)),
              1e-12);
    EXPECT_LT(glm::length(rotationToUp({0, -1, 0}) * glm::dvec3(0, 1, 0) - glm::dvec3(0, -1, 0)),
              1e-12);
}

TEST(RotationToUp, TakesAnyLength) {
    const glm::dvec3 up(0.3, -0.2, 0.7);
    const auto expected = rotationToUp(up);
    for (const double length : {0x1p-1000, 0x1p-600, 0x1p600, 0x1p1000})
        EXPECT_EQ(rotationToUp(up * length), expected) << length;
}

TEST(Camera, LookAtTakesAnUpOfAnyLength) {
    const glm::dvec3 up(0.3, -0.2, 0.7);
    const auto expected = lookAt({5, 1, 2}, {0, 0, 0}, up);
    ASSERT_TRUE(expected);
    for (const double length : {0x1p-1000, 0x1p-600, 0x1p600, 0x1p1000}) {
        const auto found = lookAt({5, 1, 2}, {0, 0, 0}, up * length);
        ASSERT_TRUE(found) << length;
        EXPECT_EQ(*found, *expected) << length;
    }
    const auto far = lookAt({5, 0, 0}, {0, 0, 0}, {0, 0, 1e170});
    ASSERT_TRUE(far);
    EXPECT_LT(glm::length(*far * glm::dvec3(0, 1, 0) - glm::dvec3(0, 0, 1)), 1e-12);
}

}  // namespace
}  // namespace stx
