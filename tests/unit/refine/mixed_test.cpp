#include "lib/refine/mixed.hpp"

#include <gtest/gtest.h>

#include "lib/geometry/depth_code.hpp"

namespace stx {
namespace {

TEST(MixedPixels, GoOnlyWhenTheyHangBetweenSurfaces) {
    Image<float> d(40, 20);
    for (int y = 0; y < 20; ++y)
        for (int x = 0; x < 40; ++x)
            d.at(x, y) = x < 20 ? 1.0f : x == 20 ? 1.6f : 2.5f + 0.15f * (x - 21);
    EXPECT_EQ(dropMixedPixels(d), 20);
    for (int y = 0; y < 20; ++y) EXPECT_FALSE(hasPoint(d.at(20, y)));
}

/// In a coarse picture all neighbours of a pixel may be farther than an edge's step.
TEST(MixedPixels, ASteepWallOfACoarsePictureHasNone) {
    Image<float> d(40, 40);
    for (int y = 0; y < 40; ++y)
        for (int x = 0; x < 40; ++x)
            d.at(x, y) =
                1.0f / (0.2f + 0.05f * static_cast<float>(x) + 0.02f * static_cast<float>(y));
    d.at(20, 20) = 10;
    dropMixedPixels(d);
    // The corners have neighbours on one side only.
    for (int y = 1; y < 39; ++y)
        for (int x = 1; x < 39; ++x) EXPECT_EQ(hasPoint(d.at(x, y)), x != 20 || y != 20);
}

/// Alone between two surfaces, at equal steps to both of them in 1 / distance.
TEST(MixedPixels, GoWhereTheStepsToBothSidesAreAlike) {
    Image<float> d(9, 1);
    for (int x = 0; x < 9; ++x) d.at(x, 0) = x < 4 ? 1.0f : x == 4 ? 1 / 0.6f : 5.0f;
    EXPECT_EQ(dropMixedPixels(d), 1);
    EXPECT_FALSE(hasPoint(d.at(4, 0)));
}

}  // namespace
}  // namespace stx
