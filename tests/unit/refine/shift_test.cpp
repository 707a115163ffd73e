#include "lib/refine/shift.hpp"

#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "lib/geometry/depth_code.hpp"

namespace stx {
namespace {

constexpr int kShiftedWidth = 240, kShiftedHeight = 120;
constexpr double kSlope = 0.02;

/// Something with texture of several pixels' size, at any place between pixels; 0..1.
double pattern(double x, double y) {
    return 0.5 + 0.2 * std::sin(0.9 * x + 0.3 * y) + 0.15 * std::sin(0.37 * x - 0.5 * y + 1) +
           0.1 * std::sin(1.3 * x + 0.11 * y * y / 40);
}

/// The pattern on a slanted surface, from `steps` beside; brighter by `gain`, `down` rows lower.
Texture seenFrom(double steps, double gain = 1.0, double down = 0) {
    Image<glm::vec4> picture(kShiftedWidth, kShiftedHeight);
    for (int y = 0; y < kShiftedHeight; ++y)
        for (int x = 0; x < kShiftedWidth; ++x) {
            // x - steps * (20 + kSlope * x0) = x, solved for x0.
            const double x0 = (x + steps * 20) / (1 - steps * kSlope);
            picture.at(x, y) =
                glm::vec4(glm::vec3(static_cast<float>(gain * pattern(x0, y - down))), 1.0f);
        }
    return picture;
}

/// Disparities that are `less` than they are.
Image<float> disparities(double less) {
    Image<float> d(kShiftedWidth, kShiftedHeight);
    for (int y = 0; y < kShiftedHeight; ++y)
        for (int x = 0; x < kShiftedWidth; ++x)
            d.at(x, y) = static_cast<float>(20 + kSlope * x - less);
    return d;
}

TEST(PictureShift, IsWhatPicturesOnEitherSideShow) {
    for (const double less : {-0.4, 0.15, 0.3}) {
        const std::vector<SidePicture> right{{seenFrom(1), 1}};
        EXPECT_NEAR(pictureShift(disparities(less), seenFrom(0), right, 0.6).disparity, less, 0.03);
        const std::vector<SidePicture> both{{seenFrom(0.5), 0.5}, {seenFrom(-0.25, 0.97), -0.25}};
        EXPECT_NEAR(pictureShift(disparities(less), seenFrom(0), both, 0.6).disparity, less, 0.05);
    }
}

TEST(PictureShift, RowsAreWhereEachPictureShowsThem) {
    for (const double down : {-0.3, 0.12}) {
        const std::vector<SidePicture> both{{seenFrom(0.5, 1, down), 0.5},
                                            {seenFrom(-0.25), -0.25}};
        const PictureShift found = pictureShift(disparities(0.15), seenFrom(0), both, 0.6);
        ASSERT_EQ(found.down.size(), 2u);
        EXPECT_NEAR(found.down[0], down, 0.03);
        EXPECT_EQ(found.down[1], 0.0) << "its rows are right";
        EXPECT_NEAR(found.disparity, 0.15, 0.05);
    }
    const std::vector<SidePicture> far{{seenFrom(1, 1, 1.5), 1}};
    EXPECT_EQ(pictureShift(disparities(0), seenFrom(0), far, 0.6).down[0], 0.0)
        << "off by too much";
}

TEST(PictureShift, IsNoneWhereNothingTells) {
    const std::vector<SidePicture> right{{seenFrom(1), 1}};
    EXPECT_EQ(pictureShift(disparities(0), seenFrom(0), right, 0.6).disparity, 0.0)
        << "nothing is off";
    EXPECT_EQ(pictureShift(disparities(2), seenFrom(0), right, 0.6).disparity, 0.0)
        << "off by too much";
    EXPECT_EQ(pictureShift(disparities(0.3), seenFrom(0), {}, 0.6).disparity, 0.0);
    const Texture plain = Image<glm::vec4>(kShiftedWidth, kShiftedHeight, glm::vec4(0.5f));
    EXPECT_EQ(pictureShift(disparities(0.3), plain, right, 0.6).disparity, 0.0) << "no texture";
    const Image<float> unknown(kShiftedWidth, kShiftedHeight, kNoDepth);
    EXPECT_EQ(pictureShift(unknown, seenFrom(0), right, 0.6).disparity, 0.0);
}

}  // namespace
}  // namespace stx
