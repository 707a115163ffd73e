#include "lib/render/surface/cpu/fuse.hpp"

#include <bit>

#include <gtest/gtest.h>

namespace stx::surface {
namespace {

Camera cameraOf(int size) {
    return Camera::fromFieldOfView({0, 0, 0}, {1, 0, 0, 0}, {1.0, 1.0}, false, size, size);
}

/// A wall across the whole view, facing it.
ReferenceView wallAt(float dist) {
    ReferenceView view;
    view.camera = cameraOf(kTile);
    view.depthBits = 32;
    view.depth = Image<float>(kTile, kTile, dist);
    view.nearPlane = 0.5 * dist;
    view.farPlane = 2 * dist;
    view.texture = Texture(Rgba8Image(kTile, kTile, glm::u8vec4(255)));
    return view;
}

TEST(Fuse, OneSurfaceInAPixelHasNoFlagsWhateverItsMean) {
    // One source shows a wall at 1, another looks past it at a wall at 2. One vote does not reject
    // what is far from any edge; the mean of the samples may be any number.
    Bundle bundle;
    bundle.views = {wallAt(1.0f), wallAt(2.0f)};
    const SurfaceScene scene(bundle);
    const Source &shows = scene.sources[0], &looksPast = scene.sources[1];
    const PixelSpace space(cameraOf(kTile), 4.0);
    const Warp same = warpFrom(glm::dmat4(1.0));
    const SampleGrid grid{2};
    for (std::uint32_t apart = 0; apart < 64; apart += 4) {
        const auto low = std::bit_cast<std::uint32_t>(1.0f);
        std::vector<float> samples(grid.count(), std::bit_cast<float>(low));
        samples[1] = std::bit_cast<float>(low + apart);
        const std::vector<LocalSource> sources{{&shows, same, samples.data()},
                                               {&looksPast, same, nullptr}};
        Pieces pieces;
        fuseTile(sources, grid, space.axis, 0, 0, {1u}, pieces);
        EXPECT_EQ(pieces.size(), 1u) << "samples " << apart << " steps of a float apart";
    }
}

TEST(Fuse, VotesCountHalfWhereNoiseMayPutASteepSurface) {
    constexpr float kSlope = 0.002f;  // of q, a pixel
    Bundle bundle;
    bundle.views = {wallAt(2.0f)};
    for (int y = 0; y < kTile; ++y)
        for (int x = 0; x < kTile; ++x)
            bundle.views[0].depth.at(x, y) = 1.0f / (0.5f + kSlope * static_cast<float>(x));
    SurfaceScene scene(bundle);
    const LocalSource local{&scene.sources[0], warpFrom(glm::dmat4(1.0))};
    shared::Votes votes{{{&local, 1}}};
    constexpr int kMiddle = kTile / 2;
    const auto voteOn = [&](float pixelsBefore) {
        return votes.voteOf(0, kMiddle + 0.5f, kMiddle + 0.5f,
                            0.5f + kSlope * (kMiddle + pixelsBefore));
    };
    EXPECT_EQ(voteOn(1), shared::Votes::kWholeVote);
    scene.sources[0].beside = 2;
    EXPECT_EQ(voteOn(0), shared::Votes::kNoVote);
    EXPECT_EQ(voteOn(1), shared::Votes::kHalfVote);
    EXPECT_EQ(voteOn(4), shared::Votes::kWholeVote);
}

TEST(Fuse, WhoSeesBothSidesOfACreaseDoesNotSeePastIt) {
    // Two faces that meet between two columns of pixels, towards the view and away from it.
    constexpr float kSlope = 0.002f;  // of q, a pixel
    constexpr int kMiddle = kTile / 2;
    for (const bool upright : {true, false}) {
        for (const float other : {kSlope, 0.6f * kSlope, 0.0f}) {
            Bundle bundle;
            bundle.views = {wallAt(2.0f)};
            for (int y = 0; y < kTile; ++y) {
                for (int x = 0; x < kTile; ++x) {
                    const float aside = static_cast<float>(upright ? x : y) + 0.5f - kMiddle;
                    bundle.views[0].depth.at(x, y) =
                        1.0f / (0.5f + (aside < 0 ? kSlope * aside : -other * aside));
                }
            }
            SurfaceScene scene(bundle);
            const LocalSource local{&scene.sources[0], warpFrom(glm::dmat4(1.0))};
            shared::Votes votes{{{&local, 1}}};
            const auto voteOn = [&](float q) {
                const float along = kMiddle + 0.3f;
                return upright ? votes.voteOf(0, kMiddle, along, q)
                               : votes.voteOf(0, along, kMiddle, q);
            };
            EXPECT_EQ(voteOn(0.5f), shared::Votes::kNoVote) << upright << " " << other;
            EXPECT_EQ(voteOn(0.5f + kSlope), shared::Votes::kWholeVote) << upright << " " << other;
        }
    }
}

/// What a pixel of four samples shows when two sources show a wall at q = 1 and a third shows
/// `third`. What they see is nearer than all that: none has a vote against anything.
Pieces besideTwo(const std::array<std::uint32_t, 4>& third) {
    Bundle bundle;
    bundle.views = {wallAt(0.5f), wallAt(0.5f), wallAt(0.5f)};
    const SurfaceScene scene(bundle);
    const PixelSpace space(cameraOf(kTile), 4.0);
    const Warp same = warpFrom(glm::dmat4(1.0));
    const SampleGrid grid{2};
    const std::vector<float> wall(grid.count(), 1.0f);
    std::vector<float> other(grid.count(), 0.0f);
    for (std::size_t k = 0; k < 4; ++k)
        other[k / 2 * static_cast<std::size_t>(grid.stride()) + k % 2] =
            std::bit_cast<float>(third[k]);
    const std::vector<LocalSource> sources{{&scene.sources[0], same, wall.data()},
                                           {&scene.sources[1], same, wall.data()},
                                           {&scene.sources[2], same, other.data()}};
    Pieces pieces;
    fuseTile(sources, grid, space.axis, 0, 0, {1u}, pieces);
    return pieces;
}

TEST(Fuse, WhatTwoSourcesAgreeOnNeedsNoThird) {
    const auto bits = [](float q, std::uint32_t flags) {
        return (std::bit_cast<std::uint32_t>(q) & ~kSampleFlags) | flags;
    };
    const std::uint32_t nearEdge = bits(1.0f, kNearEdgeBit),
                        extension = bits(1.0f, kNearEdgeBit | kExtensionBit),
                        behind = bits(0.5f, kNearEdgeBit), before = bits(1.5f, kNearEdgeBit);
    struct Case {
        const char* name;
        std::array<std::uint32_t, 4> third;
        std::uint32_t seenBy;
    };
    for (const Case& c : {Case{"nothing", {0, 0, 0, 0}, 3u},
                          Case{"the wall, near its edge", {nearEdge, nearEdge, 0, 0}, 7u},
                          Case{"an extension", {extension, extension, extension, 0}, 3u},
                          Case{"an extension and the wall", {extension, nearEdge, 0, 0}, 7u},
                          Case{"something behind", {behind, behind, behind, behind}, 3u}}) {
        const Pieces pieces = besideTwo(c.third);
        ASSERT_EQ(pieces.size(), 1u) << c.name;
        EXPECT_EQ(pieces.q[0], 1.0f) << c.name;
        EXPECT_EQ(pieces.share[0], 1.0f) << c.name;
        EXPECT_EQ(pieces.sources[0], c.seenBy) << c.name;
    }
    // What the third shows before the wall is not passed over.
    const Pieces inFront = besideTwo({before, 0, 0, 0});
    ASSERT_EQ(inFront.size(), 2u);
    EXPECT_NEAR(inFront.q[0], 1.5f, 1e-5f);
    EXPECT_NEAR(inFront.share[0], 0.25f, 1e-6f);
}

}  // namespace
}  // namespace stx::surface
