#include "lib/refine/align.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "lib/geometry/depth_code.hpp"

namespace stx {
namespace {

constexpr int kSide = 64;
constexpr float kFront = 2, kBack = 3;

/// Share of a pixel that a disc in the middle covers, 8x8 samples.
double covered(int x, int y, double radius) {
    int in = 0;
    for (int k = 0; k < 64; ++k)
        in += std::hypot(x + (k % 8 + 0.5) / 8 - 32, y + (k / 8 + 0.5) / 8 - 32) < radius;
    return in / 64.0;
}

struct Scene {
    Texture texture;
    Image<float> depth{kSide, kSide};
};

/// A disc of radius 20 before a wall, with a depth image whose disc is smaller by `shrunk` pixels.
Scene disc(double shrunk, glm::vec3 front, glm::vec3 back) {
    Scene scene;
    Rgba8Image colour(kSide, kSide);
    for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x) {
            const auto share = static_cast<float>(covered(x, y, 20));
            // A wall with some pattern.
            const glm::vec3 wall = back + ((x / 3 + y / 3) % 2 == 0 ? 12.0f : 0.0f);
            colour.at(x, y) = glm::u8vec4(glm::mix(wall, front, share) + 0.5f, 255);
            scene.depth.at(x, y) =
                std::hypot(x + 0.5 - 32, y + 0.5 - 32) < 20 - shrunk ? kFront : kBack;
        }
    scene.texture = std::move(colour);
    return scene;
}

TEST(DepthEdges, ThinForegroundGrowsToItsColours) {
    Scene scene = disc(1.2, {30, 160, 40}, {200, 180, 150});
    const auto before = scene.depth;
    const auto moved = alignDepthEdges(scene.depth, scene.texture);
    std::int64_t changed = 0;
    for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x) {
            const double share = covered(x, y, 20);
            // 0.35 of the colour decides; the wall's pattern blurs that a little.
            if (share > 0.45) {
                ASSERT_EQ(scene.depth.at(x, y), kFront) << x << "," << y << " share " << share;
            } else if (share < 0.2) {
                ASSERT_EQ(scene.depth.at(x, y), kBack) << x << "," << y << " share " << share;
            }
            changed += scene.depth.at(x, y) != before.at(x, y);
        }
    EXPECT_EQ(moved, changed);
    EXPECT_GT(moved, 100);
}

TEST(DepthEdges, RightOnesAndLikeColoursStay) {
    Scene right = disc(-0.4, {30, 160, 40}, {200, 180, 150});
    const auto before = right.depth;
    EXPECT_EQ(alignDepthEdges(right.depth, right.texture), 0);
    EXPECT_EQ(right.depth, before);
    Scene same = disc(1.2, {120, 120, 120}, {120, 120, 120});
    same.texture = Rgba8Image(kSide, kSide, {120, 120, 120, 255});
    EXPECT_EQ(alignDepthEdges(same.depth, same.texture), 0);
}

TEST(DepthEdges, UnknownStaysUnknownAndNothingComesForwardFromIt) {
    Scene scene = disc(1.2, {30, 160, 40}, {200, 180, 150});
    for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x)
            if (scene.depth.at(x, y) == kFront) scene.depth.at(x, y) = kNoDepth;
    const auto before = scene.depth;
    EXPECT_EQ(alignDepthEdges(scene.depth, scene.texture), 0);
    EXPECT_EQ(scene.depth, before);
}

}  // namespace
}  // namespace stx
