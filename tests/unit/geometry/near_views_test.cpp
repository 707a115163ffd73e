#include "lib/geometry/near_views.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace stx {
namespace {

using Numbers = std::vector<std::size_t>;

/// Twenty cameras in a row, a unit apart, that look along -Z.
std::vector<Camera> row(bool orthographic) {
    std::vector<Camera> cameras(20);
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        cameras[i].orthographic = orthographic;
        cameras[i].position = {static_cast<double>(i), 0, 0};
    }
    return cameras;
}

Numbers near(const std::vector<Camera>& cameras, std::size_t number, glm::dvec3 place,
             std::size_t most) {
    return nearViews(
        cameras.size(), [&](std::size_t i) -> const Camera& { return cameras[i]; }, number, place,
        most);
}

TEST(NearViews, OfARowOfParallelCamerasAreThoseBeside) {
    for (const bool orthographic : {false, true}) {
        const auto cameras = row(orthographic);
        auto found = near(cameras, 15, {15, 0, -50}, 4);
        std::sort(found.begin(), found.end());
        EXPECT_EQ(found, (Numbers{13, 14, 16, 17})) << orthographic;
    }
}

TEST(NearViews, LookFromTheSameSideAndHaveThePlaceInFront) {
    auto cameras = row(false);
    cameras.resize(3);
    cameras[1].position = {0, 0, -20};  // sees the place from behind
    cameras[1].orientation = {0, 0, 1, 0};
    cameras[2].position = {0, 0, -11};  // is beyond it, looks away
    EXPECT_TRUE(near(cameras, 0, {0, 0, -10}, 8).empty());
}

/// Cameras in a circle around the y axis that look at its middle, ten units away.
std::vector<Camera> circle(std::size_t count) {
    std::vector<Camera> cameras(count);
    for (std::size_t i = 0; i < count; ++i) {
        const double angle =
            glm::radians(360.0) * static_cast<double>(i) / static_cast<double>(count);
        Camera& c = cameras[i];
        c.position = {10 * std::sin(angle), 0, 10 * std::cos(angle)};
        c.orientation = *lookAt(c.position, {0, 0, 0});
        c.width = c.height = 100;
        c.fx = c.fy = 100;
        c.cx = c.cy = 50;
    }
    return cameras;
}

Numbers around(const std::vector<Camera>& cameras, std::size_t number, std::size_t most) {
    return viewsAround(
        cameras.size(), [&](std::size_t i) -> const Camera& { return cameras[i]; }, number,
        {0, 0, 0}, most);
}

TEST(ViewsAround, LookFromDirectionsThatDiffer) {
    const auto cameras = circle(100);
    auto found = around(cameras, 17, 5);
    ASSERT_EQ(found.size(), 5u);
    found.push_back(17);
    for (const std::size_t a : found)
        for (const std::size_t b : found)
            if (a != b) {
                // Six directions, of which opposite ones are the same, are 30 degrees apart at
                // most.
                const double cosine = glm::dot(cameras[a].forward(), cameras[b].forward());
                EXPECT_LT(std::abs(cosine), std::cos(glm::radians(20.0))) << a << ' ' << b;
            }
}

TEST(ViewsAround, AreAllOfFew) {
    EXPECT_EQ(around(circle(5), 2, 4), (Numbers{0, 1, 3, 4}));
}

TEST(ViewsAround, HaveThePlaceInTheirPictureIfEnoughDo) {
    auto cameras = circle(40);
    for (std::size_t i = 0; i < 40; i += 2) {
        // Half of them look 60 degrees aside, and one in four of these away.
        const double turn = i % 8 == 0 ? 180.0 : 60.0;
        cameras[i].orientation =
            cameras[i].orientation * glm::angleAxis(glm::radians(turn), glm::dvec3(0, 1, 0));
    }
    auto found = around(cameras, 1, 30);
    ASSERT_EQ(found.size(), 30u);
    for (std::size_t k = 0; k < 19; ++k) EXPECT_EQ(found[k] % 2, 1u) << k;
    for (std::size_t k = 19; k < 30; ++k) {
        EXPECT_EQ(found[k] % 2, 0u) << k;
        EXPECT_NE(found[k] % 8, 0u) << k;
    }
}

Numbers thatMayShow(const std::vector<Camera>& cameras, std::size_t number,
                    const ShownSphere& sphere, std::size_t most) {
    return viewsThatMayShow(
        cameras.size(), [&](std::size_t i) -> const Camera& { return cameras[i]; }, number, sphere,
        most);
}

TEST(ViewsThatMayShow, LookThereWhereAllTurnAroundOnePlace) {
    auto cameras = circle(100);
    for (Camera& c : cameras) c.position = {0, 0, 0};
    const glm::dvec3 place = 10.0 * cameras[30].forward();
    // Half a picture is 26.6 degrees, the sphere's radius 5.7.
    const auto found = thatMayShow(cameras, 30, {place, 1}, 60);
    EXPECT_EQ(found.size(), 16u);
    for (const std::size_t i : found)
        EXPECT_GT(glm::dot(cameras[i].forward(), cameras[30].forward()),
                  std::cos(glm::radians(32.4)))
            << i;
    EXPECT_EQ(thatMayShow(cameras, 30, {place, 1}, 99).size(), 99u);
}

TEST(ViewsThatMayShow, HoldForPicturesThatAreNotInTheMiddleOfTheirLens) {
    for (const bool orthographic : {false, true}) {
        std::vector<Camera> cameras(3);
        for (Camera& c : cameras) {
            c.orthographic = orthographic;
            c.width = 100;
            c.height = 50;
            c.fx = c.fy = orthographic ? 10 : 100;
            c.cx = 10;
            c.cy = 45;
        }
        // Of the part that is seen at a distance of 10 x goes from -1 to 9, y from -0.5 to 4.5.
        for (const auto& [place, shown] : {std::pair(glm::dvec3(8.5, 4, -10), true),
                                           {glm::dvec3(9.4, 4, -10), true},
                                           {glm::dvec3(-1.4, 4, -10), true},
                                           {glm::dvec3(-2, 4, -10), false},
                                           {glm::dvec3(10, 4, -10), false},
                                           {glm::dvec3(8, 5.2, -10), false},
                                           {glm::dvec3(8, -1.1, -10), false},
                                           {glm::dvec3(8, -0.9, -10), true}})
            EXPECT_EQ(thatMayShow(cameras, 0, {place, 0.5}, 1).size(), shown ? 1u : 0u)
                << orthographic << ' ' << place.x << ' ' << place.y;
    }
}

TEST(ViewsToLookFor, AreThoseOfTheViewsWhoMayShowThem) {
    const auto cameras = circle(90);
    const auto camera = [&](std::size_t i) -> const Camera& { return cameras[i]; };
    const auto sphere = [](std::size_t) { return ShownSphere{{0, 0, 0}, 1}; };
    const auto found = viewsToLookFor(cameras.size(), camera, sphere);
    ASSERT_EQ(found.size(), cameras.size());
    std::size_t all = 0;
    for (std::size_t at = 0; at < found.size(); ++at) {
        all += found[at].size();
        for (const std::size_t i : found[at]) {
            const auto mayShow = thatMayShow(cameras, i, sphere(i), kMostCompared);
            EXPECT_TRUE(std::ranges::binary_search(mayShow, at)) << at << ' ' << i;
        }
    }
    // Those beyond 120 degrees see the other side.
    EXPECT_EQ(all, 90u * 58);
}

}  // namespace
}  // namespace stx
