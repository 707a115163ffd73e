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

}  // namespace
}  // namespace stx
