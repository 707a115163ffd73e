#include "lib/geometry/view_layout.hpp"

#include <gtest/gtest.h>

#include "formats/stx/stx.hpp"
#include "lib/capture/capture.hpp"
#include "lib/render/scene/page_set.hpp"

namespace stx {
namespace {

const std::vector<glm::vec3> kPoints = {
    {1, 0, 0}, {-1, 0.5f, 0}, {0, -0.7f, 0.3f}, {0.2f, 0.4f, -1}};

std::vector<Camera> camerasAround(double scale, glm::vec3 centre, ViewLayout::Kind kind) {
    auto points = kPoints;
    for (auto& p : points) p = p * static_cast<float>(scale) + centre;
    ViewLayout layout;
    layout.kind = kind;
    layout.count = 8;
    const auto cameras = layoutCameras(layout, {}, points);
    EXPECT_TRUE(cameras);
    return cameras ? *cameras : std::vector<Camera>{};
}

TEST(LayoutCameras, FollowTheSizeOfTheObject) {
    const auto unit = camerasAround(1, {}, ViewLayout::Kind::sphere);
    for (const double scale : {1e-15, 1e-9, 1e-7, 1e-3, 1e9}) {
        const auto scaled = camerasAround(scale, {}, ViewLayout::Kind::sphere);
        ASSERT_EQ(scaled.size(), unit.size());
        for (std::size_t i = 0; i < unit.size(); ++i) {
            EXPECT_NEAR(scaled[i].fx / unit[i].fx, 1, 1e-5) << scale;
            EXPECT_LT(glm::distance(scaled[i].position / scale, unit[i].position), 1e-5) << scale;
        }
    }
}

TEST(LayoutCameras, SeeASinglePoint) {
    for (const glm::vec3 place : {glm::vec3(0), glm::vec3(1e-9f), glm::vec3(5, 0, 0)}) {
        for (const Camera& c : camerasAround(0, place, ViewLayout::Kind::ring)) {
            EXPECT_TRUE(c.check());
            EXPECT_GT(glm::distance(c.position, glm::dvec3(place)), 0);
        }
    }
}

TEST(LayoutCameras, OfARingTurnFromStraightAboveAsFromJustBeside) {
    for (const double side : {1.0, -1.0}) {
        for (const glm::dvec3 up : {glm::dvec3(0, 1, 0), glm::dvec3(1, 2, 0.5)}) {
            ViewFraming framing;
            framing.up = up;
            ViewLayout above, beside;
            above.kind = beside.kind = ViewLayout::Kind::ring;
            above.count = beside.count = 4;
            above.elevationRad = side * std::numbers::pi / 2;
            beside.elevationRad = side * (std::numbers::pi / 2 - 1e-4);
            const auto a = layoutCameras(above, framing, kPoints),
                       b = layoutCameras(beside, framing, kPoints);
            ASSERT_TRUE(a && b);
            for (std::size_t i = 0; i < 4; ++i)
                EXPECT_GT(std::abs(glm::dot((*a)[i].orientation, (*b)[i].orientation)), 1 - 1e-6)
                    << side << ' ' << i;
        }
    }
}

TEST(DepthRange, OfWhatIsFlatFollowsItsDistance) {
    for (const float distance : {3e-9f, 1e-12f, 1.0f, 1e6f}) {
        ReferenceView view;
        view.depth = Image<float>(2, 2);
        for (float& d : view.depth.pixels()) d = distance;
        fitDepthRange(view);
        EXPECT_GT(view.nearPlane, 0.99f * distance);
        EXPECT_LT(view.farPlane, 1.01f * distance);
    }
}

TEST(SameCamera, OnTheScaleOfItsPosition) {
    for (const double scale : {1.0, 1e-9, 1e-10}) {
        Camera a;
        a.position = {scale, 0, 0};
        Camera b = a;
        EXPECT_TRUE(sameCamera(a, b));
        b.position.x *= 1 + 1e-12;
        EXPECT_TRUE(sameCamera(a, b)) << scale;
        b.position.y = 0.01 * scale;
        EXPECT_FALSE(sameCamera(a, b)) << scale;
    }
    Camera origin, turned;
    turned.position = {1e-17, 0, -6e-15};
    EXPECT_TRUE(sameCamera(origin, turned));
}

TEST(OrbitCameras, FollowTheRadius) {
    const auto unit = orbitCameras({}, 1, {}, {});
    const auto tiny = orbitCameras({}, 1e-12, {}, {});
    ASSERT_TRUE(unit && tiny);
    EXPECT_LT(glm::distance((*tiny)[0].position * 1e12, (*unit)[0].position), 1e-6);
}

TEST(OrbitCameras, TurnFromStraightAboveAsFromJustBeside) {
    for (const double side : {1.0, -1.0}) {
        CameraSettings lens;
        lens.up = glm::dvec3(1, 2, 0.5);
        OrbitSettings above, beside;
        above.count = beside.count = 4;
        above.elevationRad = side * std::numbers::pi / 2;
        beside.elevationRad = side * (std::numbers::pi / 2 - 1e-4);
        const auto a = orbitCameras({}, 1, above, lens), b = orbitCameras({}, 1, beside, lens);
        ASSERT_TRUE(a && b);
        for (std::size_t i = 0; i < 4; ++i)
            EXPECT_GT(std::abs(glm::dot((*a)[i].orientation, (*b)[i].orientation)), 1 - 1e-6) << i;
    }
}

}  // namespace
}  // namespace stx
