#include "lib/geometry/near_views.hpp"

#include <algorithm>
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

}  // namespace
}  // namespace stx
