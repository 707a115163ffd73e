// What a frame of one pose shows along the rays of another, and what stays of many of them.

#include "lib/background/frame_warp.hpp"

#include <gtest/gtest.h>

#include "lib/background/key_background.hpp"
#include "tests/wall_with_block.hpp"

namespace stx::temporal {
namespace {

using test::kHeight, test::kWall, test::kWidth, test::wallWithBlock;

/// Another pose beside the wall's camera.
Camera turnedCamera() {
    Camera camera = wallWithBlock(0, 0, 2).camera;
    camera.position = {0.4, -0.2, 0.3};
    camera.orientation = glm::angleAxis(0.15, glm::normalize(glm::dvec3(0.2, 1, 0.1)));
    camera.cx += 3;
    return camera;
}

}  // namespace

TEST(FrameWarp, PointsFallWhereTheOtherCameraSeesThem) {
    const Camera from = wallWithBlock(0, 0, 2).camera, to = turnedCamera();
    const CameraPair pair(from, to);
    for (const glm::vec3 at : {glm::vec3(24, 18, 4), glm::vec3(3.5, 30, 2), glm::vec3(44, 2, 7)}) {
        const glm::dvec3 world =
            from.position + from.orientation * from.unproject(at.x, at.y, at.z);
        const glm::dvec3 there = glm::conjugate(to.orientation) * (world - to.position);
        const glm::dvec3 expected = to.project(there);
        const auto ray = pair.ray(at.x, at.y);
        const glm::vec3 found = pair.at(ray, at.z);
        EXPECT_NEAR(found.x, expected.x, 1e-3);
        EXPECT_NEAR(found.y, expected.y, 1e-3);
        EXPECT_NEAR(found.z, -there.z, 1e-5);
        EXPECT_NEAR(pair.back(ray, found.z), at.z, 1e-4);
    }
}

TEST(FrameWarp, BetweenPixelsOfOneSurfaceItIsInterpolated) {
    ReferenceView view = wallWithBlock(18, 30, 2);
    // Inverse distances of a plane are affine over the picture.
    const auto inverseAt = [](float x, float y) { return 0.25f + 0.0004f * x - 0.0002f * y; };
    for (int y = 0; y < 8; ++y)
        for (int x = 0; x < kWidth; ++x)
            view.depth.at(x, y) = 1 / inverseAt(static_cast<float>(x), static_cast<float>(y));
    const WarpFrame frame = warpFrame(view, view.camera, {});
    const Spot spot = spotAt(frame, 10.7f, 4.2f);
    EXPECT_TRUE(spot.whole);
    EXPECT_NEAR(spot.inverse, inverseAt(10.2f, 3.7f), 1e-6);
    // Beside the block, whose edge is at x = 18, it is the nearest pixel's.
    const Spot edge = spotAt(frame, 18.2f, 20.5f);
    EXPECT_FALSE(edge.whole);
    EXPECT_EQ(edge.inverse, 0.5f);
    EXPECT_EQ(edge.x, 18);
    EXPECT_EQ(spotAt(frame, -0.1f, 5).inverse, 0);
    EXPECT_EQ(spotAt(frame, 5, static_cast<float>(kHeight)).inverse, 0);
}

TEST(FrameWarp, ColoursAreNoDarkerAndNoLighterThanWhatIsThere) {
    ReferenceView view = wallWithBlock(0, 0, 2);
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x)
            view.texture.rgba8()->at(x, y) = glm::u8vec4(x < 20 ? 40 : 200, 0, 0, 255);
    const WarpFrame frame = warpFrame(view, view.camera, {});
    const auto redAt = [&](float x) {
        return colourAt(frame, spotAt(frame, x, 12.5f), x, 12.5f).r;
    };
    EXPECT_NEAR(redAt(15.5f), 40, 1e-3);
    EXPECT_NEAR(redAt(20.0f), 120, 1e-3) << "half way over the edge";
    for (float x = 17; x < 23; x += 0.1f) {
        EXPECT_GE(redAt(x), 40);
        EXPECT_LE(redAt(x), 200);
    }
    // A cubic kernel is steeper than a line.
    EXPECT_LT(redAt(19.7f), 40 + 160 * 0.2f - 1);
}

TEST(FrameWarp, AFrameLooksThroughAPlaceOnlyWithinAKnownMargin) {
    ReferenceView view = wallWithBlock(18, 30, 2);
    view.depth.at(40, 30) = kNoDepth;
    view.texture.rgba8()->at(40, 30) = glm::u8vec4(0);
    const WarpFrame frame = carveFrame(view, view.camera, false);
    const auto clear = [](const WarpFrame& f, int x, int y, float distance) {
        return clearView(f, {static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f, distance},
                         0.1f);
    };
    EXPECT_TRUE(clear(frame, 8, 20, 3)) << "the wall is behind it";
    EXPECT_FALSE(clear(frame, 8, 20, 3.8f)) << "nearly on the wall";
    EXPECT_FALSE(clear(frame, 24, 20, 3)) << "behind the block";
    EXPECT_FALSE(clear(frame, 16, 20, 3)) << "two pixels beside the block";
    EXPECT_TRUE(clear(frame, 15, 20, 3));
    EXPECT_FALSE(clear(frame, 8, 20, -3)) << "behind the camera";
    EXPECT_FALSE(clear(frame, 42, 32, 3)) << "beside what the sensor missed";
    EXPECT_TRUE(clear(carveFrame(view, view.camera, true), 42, 32, 3)) << "beside empty space";
}

TEST(KeyBackground, KeepsWhatFramesDoNotLookThrough) {
    // In three frames of the pose the block stands before the wall; from both sides later frames
    // look through where it was.
    const ReferenceView key = wallWithBlock(18, 30, 2);
    KeyBackground background(key, 0.04);
    std::vector<ReferenceView> frames = {key, key, key};
    for (int i = 1; i < 7; ++i) {
        ReferenceView frame = wallWithBlock(0, 0, 2);
        frame.camera.position.x = 0.1 * (i % 2 == 0 ? i : -i);
        // The wall as this pose sees it: its colours are those of the points.
        for (int y = 0; y < kHeight; ++y)
            for (int x = 0; x < kWidth; ++x) {
                const glm::dvec3 point = frame.worldPoint(x, y);
                const glm::dvec3 at = key.camera.project(point - key.camera.position);
                frame.texture.rgba8()->at(x, y) = glm::u8vec4(
                    static_cast<std::uint8_t>(std::clamp(90 + 2 * (at.x - 0.5) + 0.5, 0.0, 255.0)),
                    static_cast<std::uint8_t>(std::clamp(80 + 3 * (at.y - 0.5) + 0.5, 0.0, 255.0)),
                    130, 255);
            }
        frames.push_back(frame);
    }
    DepthNoise noise;
    std::uint32_t number = 0;
    for (const auto& frame : frames) {
        const FrameGauge light = background.measure(frame, frame.camera, noise);
        background.see(warpFrame(frame, frame.camera, noise), light, noise, number,
                       static_cast<float>(number));
        ++number;
    }
    for (const auto& frame : frames)
        background.carve(carveFrame(frame, frame.camera, false), noise);
    const BackgroundModel model = background.finish(static_cast<int>(number), 0, noise);
    EXPECT_TRUE(model.view.background);
    EXPECT_EQ(model.frames, 9);
    // The last row has no pixels below it to interpolate with, which counts less.
    int wall = 0;
    for (int y = 8; y < kHeight - 1; ++y)
        for (int x = 18; x < 30; ++x) {
            wall += std::abs(model.view.depth.at(x, y) - kWall) < 0.01f;
            const glm::ivec4 colour(model.view.texture.rgba8()->at(x, y));
            EXPECT_NEAR(colour.r, 90 + 2 * x, 2);
            EXPECT_NEAR(colour.g, 80 + 3 * y, 2);
        }
    EXPECT_EQ(wall, 12 * (kHeight - 9)) << "all that the block hid";
}

}  // namespace stx::temporal
