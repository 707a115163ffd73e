// Cameras that were given beside those of views move as these did.

#include <cmath>
#include <functional>
#include <random>

#include <gtest/gtest.h>

#include "lib/registration/camera_moves.hpp"

using namespace stx;

namespace {

const glm::dvec3 kTarget(0.3, -0.2, -1);

Camera cameraFrom(glm::dvec3 eye) {
    return Camera::fromFieldOfView(eye, *lookAt(eye, kTarget), {1.0, 0.8}, false, 64, 48);
}

CameraMove someMove(double size) {
    return {size * glm::dvec3(0.3, -0.5, 0.2),
            glm::angleAxis(size, glm::normalize(glm::dvec3(1, 2, -0.5)))};
}

/// Three views on a line, the first and the last of which moved, each by its own.
std::vector<ViewHeader> movedViews() {
    std::vector<ViewHeader> views(3);
    for (int i = 0; i < 3; ++i) {
        views[static_cast<std::size_t>(i)].camera = cameraFrom({0.4 * i, 0.1, 2});
        views[static_cast<std::size_t>(i)].nearPlane = 2;
        views[static_cast<std::size_t>(i)].farPlane = 4;
    }
    moveCamera(views[0], someMove(0.02));
    moveCamera(views[2], someMove(-0.03));
    return views;
}

MovesOfNeighbours among(const std::vector<ViewHeader>& views) {
    std::vector<MovedCamera> out;
    for (const ViewHeader& view : views) out.push_back(MovedCamera::of(view));
    return MovesOfNeighbours(std::move(out));
}

/// Views around the target, each moved as `moves` says.
std::vector<ViewHeader> viewsAround(int count, const std::function<CameraMove(int)>& moves) {
    std::vector<ViewHeader> views(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) {
        ViewHeader& view = views[static_cast<std::size_t>(i)];
        const double angle = 6.28 * i / count;
        view.camera = cameraFrom(kTarget + 3.0 * glm::dvec3(std::sin(angle), 0.2, std::cos(angle)));
        view.nearPlane = 2;
        view.farPlane = 4;
        moveCamera(view, moves(i));
    }
    return views;
}

void expectNear(const Camera& a, const Camera& b, double tolerance) {
    EXPECT_LT(glm::length(a.position - b.position), tolerance);
    EXPECT_GT(std::abs(glm::dot(a.orientation, b.orientation)), 1 - tolerance * tolerance);
}

TEST(CameraMoves, ACameraGivenAsAViewsIsWhereThatIsNow) {
    const auto views = movedViews();
    for (int i = 0; i < 3; ++i)
        expectNear(among(views).aligned(cameraFrom({0.4 * i, 0.1, 2})),
                   views[static_cast<std::size_t>(i)].camera, 1e-7);
}

TEST(CameraMoves, HalfWayItMovesByAboutTheMean) {
    const auto views = movedViews();
    const Camera given = cameraFrom({0.2, 0.1, 2});
    const CameraMove move = moveBetween(given, among(views).aligned(given));
    const CameraMove half = someMove(0.01);
    EXPECT_LT(glm::length(move.shift - half.shift), 0.3 * glm::length(half.shift));
    EXPECT_LT(glm::angle(glm::normalize(move.turn * glm::conjugate(half.turn))), 0.003);
}

TEST(CameraMoves, ErrorsThatEachViewHasByItselfAreNotThoseOfOthers) {
    std::mt19937 random(5);
    std::normal_distribution<double> error;
    const auto views = viewsAround(24, [&](int) {
        const glm::dvec3 shift(error(random), error(random), error(random));
        const glm::dvec3 axis(error(random), error(random), error(random));
        return CameraMove{0.02 * shift,
                          glm::angleAxis(0.01 * glm::length(axis), glm::normalize(axis))};
    });
    const auto moves = among(views);
    EXPECT_LT(moves.share(), 0.1);
    const Camera between =
        cameraFrom(kTarget + 3.0 * glm::dvec3(std::sin(0.13), 0.2, std::cos(0.13)));
    EXPECT_LT(glm::length(moves.aligned(between).position - between.position), 0.005);
    // That of a view is where the view is.
    Camera given = views[3].camera;
    given.position -= views[3].refined.moved->shift;
    given.orientation = glm::conjugate(views[3].refined.moved->turn) * given.orientation;
    expectNear(moves.aligned(given), views[3].camera, 1e-6);
}

TEST(CameraMoves, DriftIsShared) {
    const auto views = viewsAround(24, [](int i) {
        return CameraMove{{0.02 * std::sin(0.26 * i), 0.01, 0.02 * std::cos(0.26 * i)},
                          glm::angleAxis(0.01 + 0.002 * i, glm::dvec3(0, 1, 0))};
    });
    EXPECT_GT(among(views).share(), 0.85);
}

TEST(CameraMoves, BesideViewsThatStayedACameraStays) {
    auto views = movedViews();
    for (ViewHeader& view : views) view.refined.moved.reset();
    const Camera given = cameraFrom({0.1, 0.1, 2});
    EXPECT_EQ(among(views).aligned(given), given);
    EXPECT_EQ(MovesOfNeighbours().aligned(given), given);
}

TEST(CameraMoves, OneAfterTheOtherAreOneMove) {
    ViewHeader view;
    view.camera = cameraFrom({1, 1, 2});
    const Camera given = view.camera;
    moveCamera(view, someMove(0.02));
    moveCamera(view, someMove(0.05));
    ASSERT_TRUE(view.refined.moved);
    ViewHeader once;
    once.camera = given;
    moveCamera(once, *view.refined.moved);
    expectNear(once.camera, view.camera, 1e-12);
}

TEST(CameraMoves, NormalsAndSplatAxesTurnAlong) {
    ReferenceView view;
    view.camera = cameraFrom({1, 1, 2});
    const glm::dvec3 given(0.6, 0, 0.8);  // as the camera has it
    for (Image<glm::vec3>* image : {&view.normal, &view.splatU, &view.splatV})
        *image = Image<glm::vec3>(2, 1, glm::vec3(view.camera.orientation * given));
    view.normal.at(1, 0) = glm::vec3(0);
    moveCamera(view, someMove(0.2));
    EXPECT_TRUE(view.refined.moved);
    for (const Image<glm::vec3>* image : {&view.normal, &view.splatU, &view.splatV})
        EXPECT_LT(glm::distance(glm::dvec3(image->at(0, 0)), view.camera.orientation * given),
                  1e-6);
    EXPECT_EQ(view.normal.at(1, 0), glm::vec3(0));
}

TEST(CameraMoves, BoundsHoldWhatAMovedViewShows) {
    const Camera from = cameraFrom({0, 0, 2});
    ViewHeader view;
    view.camera = from;
    moveCamera(view, someMove(0.1));
    Bounds before, after;
    for (const double x : {5.0, 20.0, 60.0}) {
        for (const double dist : {2.0, 3.0}) {
            before.add(from.position + from.orientation * from.unproject(x, 0.7 * x, dist));
            after.add(view.camera.position +
                      view.camera.orientation * view.camera.unproject(x, 0.7 * x, dist));
        }
    }
    const Bounds moved = movedBounds(before, from, view.camera);
    EXPECT_TRUE(glm::all(glm::lessThanEqual(moved.min, after.min + 1e-12)));
    EXPECT_TRUE(glm::all(glm::greaterThanEqual(moved.max, after.max - 1e-12)));
    EXPECT_EQ(movedBounds(before, from, from), before);
    EXPECT_TRUE(movedBounds({}, from, view.camera).empty());
}

}  // namespace
