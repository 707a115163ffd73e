#include "lib/refine/raise_specks.hpp"

#include <gtest/gtest.h>

#include "lib/geometry/depth_code.hpp"

namespace stx {
namespace {

constexpr int kSpeckScene = 60;
constexpr float kNearDist = 1, kFarDist = 2, kBetween = 1.4f;
const glm::u8vec4 kSkin(200, 140, 120, 255), kPlaster(220, 220, 210, 255);

/// Something near at the left, a wall at the right, and beside their edge a square of `side` pixels
/// at a distance between both, of the colour `colour`.
struct EdgeWithSpeck {
    Image<float> depth{kSpeckScene, kSpeckScene, kFarDist};
    Texture picture;
    glm::ivec2 middle;

    EdgeWithSpeck(int side, glm::u8vec4 colour) : middle(30 + side / 2, 20 + side / 2) {
        Rgba8Image pixels(kSpeckScene, kSpeckScene, kPlaster);
        for (int y = 0; y < kSpeckScene; ++y)
            for (int x = 0; x < 30; ++x) {
                depth.at(x, y) = kNearDist;
                pixels.at(x, y) = kSkin;
            }
        for (int y = 20; y < 20 + side; ++y)
            for (int x = 30; x < 30 + side; ++x) {
                depth.at(x, y) = kBetween;
                pixels.at(x, y) = colour;
            }
        picture = Texture(std::move(pixels));
    }
    float joined() {
        joinSpecks(depth, picture, 3);
        EXPECT_EQ(depth.at(10, 10), kNearDist);
        EXPECT_EQ(depth.at(50, 50), kFarDist);
        return depth.at(middle.x, middle.y);
    }
};

TEST(Specks, JoinTheLargerPartThatLooksAlike) {
    EXPECT_FLOAT_EQ(EdgeWithSpeck(6, kSkin).joined(), kNearDist);
    EXPECT_FLOAT_EQ(EdgeWithSpeck(6, kPlaster).joined(), kFarDist);
}

TEST(Specks, LargerPartsStay) {
    EXPECT_EQ(EdgeWithSpeck(10, kSkin).joined(), kBetween);  // 100 pixels, 11 samples
}

TEST(Specks, WithoutALargerPartBesideThemStay) {
    Image<float> depth(9, 3, kNoDepth);
    depth.at(4, 1) = kNearDist;
    joinSpecks(depth, Texture(Rgba8Image(9, 3, kSkin)), 3);
    EXPECT_EQ(depth.at(4, 1), kNearDist);
    EXPECT_FALSE(hasPoint(depth.at(0, 0)));
}

}  // namespace
}  // namespace stx
