// Which of the surfaces that a pixel showed is the background, and what does not belong to it.

#include "lib/background/background_vote.hpp"

#include <gtest/gtest.h>

namespace stx::temporal {
namespace {

constexpr int kSide = 24;

BackgroundModel emptyModel(int width = kSide, int height = kSide) {
    BackgroundModel model;
    model.view.depthBits = 32;
    model.view.depth = Image<float>(width, height, kNoDepth);
    model.view.texture = Rgba8Image(width, height, glm::u8vec4(0));
    model.confidence = Image<float>(width, height, 0.0f);
    model.lastSeen = Image<float>(width, height, 0.0f);
    return model;
}

/// Frames that showed a surface at a distance, in a colour, one a second from `from` on.
void show(PixelLayers<ByteSample>& pixel, float distance, glm::vec3 colour, int from, int count) {
    for (int i = from; i < from + count; ++i) {
        Measurement m;
        m.q = 1 / distance;
        m.tolerance = 0.01f;
        m.key = keyOf(Worth::quiet, randomOf(0, static_cast<std::uint32_t>(i)));
        m.time = static_cast<float>(i);
        m.colour = colour;
        pixel.add(m);
    }
}

struct Decided {
    BackgroundModel model = emptyModel(1, 1);
    InFront inFront{1, 1, glm::vec2(0)};
};

Decided decide(const PixelLayers<ByteSample>& pixel, int frames) {
    Decided out;
    Vote vote;
    vote.frames = frames;
    vote.firstTime = 100;
    vote.decide(pixel, 0, out.model, out.inFront);
    return out;
}

/// A wall at 4 with a block at 2 that covers columns and rows from 8 to 16.
BackgroundModel wallAndBlock() {
    BackgroundModel model = emptyModel();
    for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x) {
            const bool block = x >= 8 && x < 16 && y >= 8 && y < 16;
            model.view.depth.at(x, y) = block ? 2.0f : 4.0f;
            model.view.texture.rgba8()->at(x, y) = glm::u8vec4(block ? 200 : 100, 0, 0, 255);
            model.confidence.at(x, y) = 1;
        }
    return model;
}

int pointsAt(const BackgroundModel& model, float depth) {
    const auto& pixels = model.view.depth.pixels();
    return static_cast<int>(std::count(pixels.begin(), pixels.end(), depth));
}

}  // namespace

TEST(BackgroundVote, TheFarthestSurfaceThatIsSupportedWins) {
    PixelLayers<ByteSample> pixel;
    show(pixel, 2, {10, 20, 30}, 0, 80);
    show(pixel, 9, {90, 90, 90}, 80, 3);  // fewer than four of a hundred: no more than a mistake
    show(pixel, 4, {50, 60, 70}, 83, 17);
    const Decided out = decide(pixel, 100);
    EXPECT_NEAR(out.model.view.depth.at(0, 0), 4, 1e-5);
    EXPECT_EQ(out.model.view.texture.rgba8()->at(0, 0), glm::u8vec4(50, 60, 70, 255));
    EXPECT_NEAR(out.model.confidence.at(0, 0), 0.17, 1e-6);
    EXPECT_NEAR(out.model.lastSeen.at(0, 0), 199, 1e-6);
    EXPECT_NEAR(out.inFront.at(0, 0).x, 0.5, 1e-6) << "what was before it";
    EXPECT_EQ(out.inFront.at(0, 0).y, 0);
}

TEST(BackgroundVote, EmptinessIsBehindAllWhereASceneIsNotAllAround) {
    PixelLayers<ByteSample> pixel;
    show(pixel, 2, {10, 20, 30}, 0, 70);
    pixel.empty = 30;
    BackgroundModel model = emptyModel(1, 1);
    InFront inFront(1, 1, glm::vec2(0));
    Vote vote;
    vote.frames = 100;
    vote.fillsFrame = false;
    vote.decide(pixel, 0, model, inFront);
    EXPECT_FALSE(hasPoint(model.view.depth.at(0, 0)));
    // In a room a sensor missed what it did not see.
    vote.fillsFrame = true;
    vote.decide(pixel, 0, model, inFront);
    EXPECT_NEAR(model.view.depth.at(0, 0), 2, 1e-5);
}

TEST(BackgroundVote, ShadowsAreNotOfItsColour) {
    PixelLayers<ByteSample> pixel;
    show(pixel, 4, {60, 60, 60}, 0, 6);
    show(pixel, 4, {120, 120, 120}, 6, 5);
    EXPECT_EQ(decide(pixel, 11).model.view.texture.rgba8()->at(0, 0),
              glm::u8vec4(120, 120, 120, 255));
    // One light sample of eleven is no light that the others lack.
    PixelLayers<ByteSample> lit;
    show(lit, 4, {60, 60, 60}, 0, 10);
    show(lit, 4, {120, 120, 120}, 10, 1);
    EXPECT_EQ(decide(lit, 11).model.view.texture.rgba8()->at(0, 0), glm::u8vec4(60, 60, 60, 255));
}

TEST(BackgroundVote, WhatGoesOnInWhatMovedIsAGhost) {
    InFront inFront(kSide, kSide, glm::vec2(0));
    BackgroundModel still = wallAndBlock();
    dropGhosts(still, inFront, {}, 0);
    EXPECT_EQ(pointsAt(still, 2), 64) << "nothing moved beside it";
    // Around the block, something at its distance came and went.
    for (int y = 6; y < 18; ++y)
        for (int x = 6; x < 18; ++x) inFront.at(x, y).x = 0.51f;
    BackgroundModel ghost = wallAndBlock();
    dropGhosts(ghost, inFront, {}, 0);
    EXPECT_EQ(pointsAt(ghost, 2), 0);
    EXPECT_EQ(pointsAt(ghost, 4), kSide * kSide - 64) << "the wall stays";
    EXPECT_EQ(ghost.view.texture.rgba8()->at(10, 10), glm::u8vec4(0));
    EXPECT_EQ(ghost.confidence.at(10, 10), 0);
    // It was at another distance.
    for (auto& q : inFront.pixels()) q *= 0.8f;
    BackgroundModel other = wallAndBlock();
    dropGhosts(other, inFront, {}, 0);
    EXPECT_EQ(pointsAt(other, 2), 64);
}

TEST(BackgroundVote, NeighboursCloseSingleGapsAndDropFlyingPixels) {
    BackgroundModel model = wallAndBlock();
    model.view.depth.at(3, 3) = 3.0f;  // agrees with nobody
    model.view.depth.at(20, 5) = kNoDepth;
    model.view.depth.at(19, 5) = 4.02f;
    model.confidence.at(19, 5) = 0.5f;
    for (const int x : {19, 20}) model.view.depth.at(x, 20) = kNoDepth;  // two beside each other
    for (const int y : {19, 21})
        for (const int x : {19, 20}) model.view.depth.at(x, y) = kNoDepth;
    checkNeighbours(model, {}, 0);
    EXPECT_FALSE(hasPoint(model.view.depth.at(3, 3)));
    EXPECT_NEAR(model.view.depth.at(20, 5), 2 / (1 / 4.02 + 1 / 4.0), 1e-5);
    EXPECT_EQ(model.confidence.at(20, 5), 0.5f) << "no better known than its neighbours";
    EXPECT_EQ(model.view.texture.rgba8()->at(20, 5), glm::u8vec4(100, 0, 0, 255));
    EXPECT_FALSE(hasPoint(model.view.depth.at(19, 20)));
    EXPECT_EQ(pointsAt(model, 2), 64);
}

}  // namespace stx::temporal
