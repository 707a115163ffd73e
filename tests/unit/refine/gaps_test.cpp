#include "lib/refine/gaps.hpp"

#include <algorithm>
#include <cstdlib>

#include <gtest/gtest.h>

#include "lib/geometry/depth_code.hpp"

namespace stx {
namespace {

constexpr int kPixels = 100;  // a gap is closed two pixels deep
constexpr float kNear = 2, kFar = 3;
const glm::u8vec4 kGreen{30, 160, 40, 255}, kCream{230, 220, 190, 255}, kDark{10, 20, 60, 255};

/// A green square before a cream wall, and no depth within `gap` pixels of the square's edge.
struct Square {
    Rgba8Image colour{kPixels, kPixels, kCream};
    Image<float> depth{kPixels, kPixels, kFar};

    explicit Square(int gap) {
        for (int y = 0; y < kPixels; ++y) {
            for (int x = 0; x < kPixels; ++x) {
                const int out =
                    std::max(std::abs(2 * x + 1 - kPixels), std::abs(2 * y + 1 - kPixels));
                if (out < kPixels / 2) {
                    colour.at(x, y) = kGreen;
                    depth.at(x, y) = kNear;
                }
                if (std::abs(out - kPixels / 2) < 2 * gap) depth.at(x, y) = kNoDepth;
            }
        }
    }
};

TEST(DepthGaps, EachPixelGoesToTheSurfaceOfItsColour) {
    Square scene(2);
    const auto open =
        std::count(scene.depth.pixels().begin(), scene.depth.pixels().end(), kNoDepth);
    ASSERT_GT(open, 700);
    EXPECT_EQ(closeDepthGaps(scene.depth, Texture(scene.colour)), open);
    for (int y = 0; y < kPixels; ++y)
        for (int x = 0; x < kPixels; ++x)
            ASSERT_FLOAT_EQ(scene.depth.at(x, y), scene.colour.at(x, y) == kGreen ? kNear : kFar)
                << x << "," << y;
}

TEST(DepthGaps, WhatIsFarFromKnownPixelsStaysOpen) {
    Square scene(4);
    closeDepthGaps(scene.depth, Texture(scene.colour));
    // Row 50 crosses the edge between columns 24 and 25: green from 25 on, known from 29 on.
    EXPECT_FLOAT_EQ(scene.depth.at(28, 50), kNear);
    EXPECT_FLOAT_EQ(scene.depth.at(27, 50), kNear);
    EXPECT_EQ(scene.depth.at(26, 50), kNoDepth);
    EXPECT_EQ(scene.depth.at(23, 50), kNoDepth);
    EXPECT_FLOAT_EQ(scene.depth.at(22, 50), kFar);
}

TEST(DepthGaps, NothingLeadsOverEdgesOfThePicture) {
    Square scene(0);
    for (int y = 40; y < 44; ++y) {
        for (int x = 5; x < 9; ++x) {
            scene.colour.at(x, y) = kDark;
            scene.depth.at(x, y) = kNoDepth;
        }
    }
    const auto before = scene.depth;
    EXPECT_EQ(closeDepthGaps(scene.depth, Texture(scene.colour)), 0);
    EXPECT_EQ(scene.depth, before);
}

TEST(DepthGaps, PlanesAreContinued) {
    Image<float> depth(kPixels, kPixels);
    const auto plane = [](int x, int y) { return 1.0f / (0.5f + 0.0005f * (x - y)); };
    for (int y = 0; y < kPixels; ++y)
        for (int x = 0; x < kPixels; ++x)
            depth.at(x, y) = x >= 50 && x < 54 ? kNoDepth : plane(x, y);
    EXPECT_EQ(closeDepthGaps(depth, Texture(Rgba8Image(kPixels, kPixels, kCream))), 4 * kPixels);
    for (int y = 0; y < kPixels; ++y)
        for (int x = 50; x < 54; ++x)
            ASSERT_NEAR(depth.at(x, y), plane(x, y), 5e-4) << x << "," << y;
}

TEST(DepthGaps, WhatIsNotOfTheObjectStaysOpen) {
    Square scene(2);
    for (auto& colour : scene.colour.pixels()) colour.a = 0;
    EXPECT_EQ(closeDepthGaps(scene.depth, Texture(scene.colour)), 0);
}

}  // namespace
}  // namespace stx
