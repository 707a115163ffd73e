// What a camera sees between two distances, and boxes beside it.
#include "lib/geometry/frustum.hpp"

#include <gtest/gtest.h>

namespace stx {
namespace {

/// Looks along -Z from 0 with 90 degrees, or through a window of 2x2.
Camera cameraOf(bool orthographic) {
    return Camera::fromFieldOfView(glm::dvec3(0), glm::dquat(1, 0, 0, 0),
                                   orthographic ? glm::dvec2(2) : glm::dvec2(1.5707963267948966),
                                   orthographic, 8, 8);
}

Bounds boxAt(glm::dvec3 centre, double half = 0.5) {
    Bounds box;
    box.add(centre - half);
    box.add(centre + half);
    return box;
}

TEST(Frustum, CornersLieOnThePlanes) {
    for (const bool orthographic : {false, true}) {
        Bounds corners;
        for (const glm::dvec3& corner : frustumCorners(cameraOf(orthographic), 2, 4))
            corners.add(corner);
        const double side = orthographic ? 1 : 4;
        EXPECT_LT(glm::length(corners.min - glm::dvec3(-side, -side, -4)), 1e-12);
        EXPECT_LT(glm::length(corners.max - glm::dvec3(side, side, -2)), 1e-12);
    }
}

TEST(Frustum, BoxesInsideAcrossAndAroundAreNotApart) {
    for (const bool orthographic : {false, true}) {
        const Camera camera = cameraOf(orthographic);
        for (const auto& box :
             {boxAt({0, 0, -3}, 0.1), boxAt({1, 0, -3}), boxAt({0, 0, -4.4}), boxAt({0, 0, 0}, 50)})
            EXPECT_FALSE(apart(camera, 2, 4, box, 0));
        EXPECT_FALSE(apart(camera, 2, 4, Bounds(), 0));
    }
}

TEST(Frustum, BoxesBeyondAnyFaceAreApart) {
    for (const bool orthographic : {false, true}) {
        const Camera camera = cameraOf(orthographic);
        for (const glm::dvec3& centre :
             {glm::dvec3(0, 0, -1), glm::dvec3(0, 0, -5), glm::dvec3(0, 0, 3), glm::dvec3(6, 0, -3),
              glm::dvec3(-6, 0, -3), glm::dvec3(0, 6, -3), glm::dvec3(0, -6, -3)})
            EXPECT_TRUE(apart(camera, 2, 4, boxAt(centre, 0.4), 0)) << centre.x << " " << centre.y;
        EXPECT_FALSE(apart(camera, 2, 4, boxAt({0, 0, -5}, 0.4), 0.7)) << "within the slack";
    }
    // In the box around what is seen, but beside the pyramid.
    EXPECT_TRUE(apart(cameraOf(false), 2, 4, boxAt({3.5, 0, -2.2}, 0.2), 0));
    EXPECT_FALSE(apart(cameraOf(true), 2, 4, boxAt({0.9, 0, -2.2}, 0.2), 0));
}

TEST(Frustum, ATurnedCameraSeesAlongItsOwnAxis) {
    Camera camera = cameraOf(false);
    camera.position = {10, 0, 0};
    camera.orientation = glm::angleAxis(1.5707963267948966, glm::dvec3(0, 1, 0));  // along -X
    EXPECT_FALSE(apart(camera, 2, 4, boxAt({7, 0, 0}), 0));
    EXPECT_TRUE(apart(camera, 2, 4, boxAt({10, 0, -3}), 0));
}

}  // namespace
}  // namespace stx
