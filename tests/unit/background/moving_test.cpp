// Backgrounds of cameras that move, on a wall before which the camera steps sideways by whole
// pixels.

#include <gtest/gtest.h>

#include "lib/background/key_views.hpp"
#include "lib/background/sequence_background.hpp"
#include "lib/base/parallel.hpp"
#include "tests/wall_with_block.hpp"

namespace stx {
namespace {

using test::kHeight, test::kWall, test::kWidth, test::wallColour, test::wallWithBlock;

/// The camera after so many steps of one pixel of the wall; something covers columns x0 to x1.
ReferenceView afterSteps(int steps, int x0, int x1, float depth = 2.0f) {
    ReferenceView view = wallWithBlock(x0, x1, depth);
    view.name = "walk";
    view.camera.position.x = steps * kWall / view.camera.fx;
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x)
            if (view.depth.at(x, y) == kWall)
                view.texture.rgba8()->at(x, y) = glm::u8vec4(wallColour(x + steps, y), 255);
    return view;
}

struct WalkedFilm {
    int frames = 0;
    std::function<ReferenceView(int)> frame;
};

Result<std::vector<BackgroundModel>> remembered(const WalkedFilm& film, Job& job,
                                                const TemporalBackgroundSettings& settings = {}) {
    std::vector<double> times;
    for (int i = 0; i < film.frames; ++i) times.push_back(i * 0.04);
    return rememberBackgrounds(
        times,
        [&](std::size_t i, Job&) -> Result<Bundle> {
            Bundle bundle;
            bundle.views = {film.frame(static_cast<int>(i))};
            return bundle;
        },
        settings, job);
}

int stepsOf(const Camera& camera) {
    return static_cast<int>(std::lround(camera.position.x * camera.fx / kWall));
}

/// Pixels of the wall, of its right colour; fails on wrong ones.
int rightWall(const ReferenceView& view) {
    int count = 0;
    for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
            const float z = view.depth.at(x, y);
            if (!hasPoint(z) || z < 0.9f * kWall) continue;
            EXPECT_NEAR(z, kWall, 0.01f);
            const glm::u8vec3 truth = wallColour(x + stepsOf(view.camera), y);
            for (int c = 0; c < 3; ++c)
                EXPECT_NEAR(view.texture.rgba8()->at(x, y)[c], truth[c], 2) << x << ' ' << y;
            ++count;
        }
    }
    return count;
}

TEST(MovingBackground, WhatMovesIsCarvedAway) {
    // It stays where it is in the picture, so it moves with the camera, and in one frame of ten it
    // is elsewhere.
    const WalkedFilm film{40, [](int i) {
                              const int from = 4 + (i % 20);
                              return afterSteps(i / 2, from, from + 12);
                          }};
    Job job;
    const auto models = remembered(film, job);
    ASSERT_TRUE(models) << models.error().text();
    ASSERT_FALSE(models->empty());
    EXPECT_TRUE(job.takeNotes().empty());
    for (const BackgroundModel& model : *models) {
        EXPECT_TRUE(model.view.background);
        EXPECT_GT(rightWall(model.view), kWidth * kHeight * 9 / 10);
        for (const float z : model.view.depth.pixels()) EXPECT_GT(z, 0.9f * kWall);
    }
    EXPECT_EQ(models->front().view.name, "walk background");
}

TEST(MovingBackground, WhatStandsBeforeTheWallStays) {
    // A board at half the distance goes by twice as fast; what it hides is seen from elsewhere, but
    // is not what is there.
    const WalkedFilm film{
        24, [](int i) { return afterSteps(i / 2, 40 - 2 * (i / 2), 48 - 2 * (i / 2)); }};
    Job job;
    const auto models = remembered(film, job);
    ASSERT_TRUE(models) << models.error().text();
    ASSERT_FALSE(models->empty());
    for (const BackgroundModel& model : *models) {
        const int left = 40 - 2 * stepsOf(model.view.camera);
        for (int y = 10; y < kHeight; ++y)
            for (int x = left + 1; x < left + 7; ++x)
                EXPECT_NEAR(model.view.depth.at(x, y), 2.0f, 0.02f) << x << ' ' << y;
        EXPECT_GT(rightWall(model.view), kWidth * kHeight / 2);
    }
}

TEST(MovingBackground, SameInAnyMemoryAndOnAnyThreads) {
    const WalkedFilm film{40, [](int i) {
                              const int from = 4 + (i % 20);
                              return afterSteps(2 * i, from, from + 12);
                          }};
    std::vector<BackgroundModel> first;
    for (const int threads : {1, 3}) {
        for (const std::uint64_t memory : {std::uint64_t{0}, std::uint64_t{600'000}}) {
            const ThreadLimit limit(threads);
            Job job;
            TemporalBackgroundSettings settings;
            settings.maxMemoryBytes = memory;
            auto models = remembered(film, job, settings);
            ASSERT_TRUE(models) << models.error().text();
            if (first.empty()) first = *models;
            ASSERT_GT(first.size(), 1u);
            ASSERT_EQ(models->size(), first.size());
            for (std::size_t i = 0; i < first.size(); ++i) {
                EXPECT_EQ((*models)[i].view.depth, first[i].view.depth);
                EXPECT_EQ((*models)[i].view.texture, first[i].view.texture);
            }
        }
    }
    Job job;
    TemporalBackgroundSettings settings;
    settings.keyViews = 1;
    EXPECT_EQ(remembered(film, job, settings)->size(), 1u);
    settings.maxMemoryBytes = 1000;
    EXPECT_FALSE(remembered(film, job, settings));
    const WalkedFilm orthographic{4, [](int i) {
                                      ReferenceView view = afterSteps(i, 0, 0);
                                      view.camera.orthographic = true;
                                      return view;
                                  }};
    const auto refused = remembered(orthographic, job);
    ASSERT_FALSE(refused);
    EXPECT_EQ(
        refused.error().text(),
        "frame 0: view 'walk': an orthographic camera moves; only perspective ones are fused");
}

TEST(KeyViews, SeeWhatAllSee) {
    std::vector<temporal::Glimpse> glimpses;
    for (int i = 0; i < 60; ++i) glimpses.push_back(temporal::glimpseOf(afterSteps(2 * i, 0, 0)));
    const auto keys = temporal::chooseKeys(glimpses, 8);
    // 60 steps of 2 pixels and 48 pixels of width: 166 columns, four pictures wide.
    ASSERT_GE(keys.size(), 3u);
    ASSERT_LE(keys.size(), 5u);
    EXPECT_EQ(temporal::chooseKeys(glimpses, 2).size(), 2u);
    EXPECT_TRUE(temporal::chooseKeys({}, 2).empty());
    const auto all = temporal::sharedPoints(glimpses[0], glimpses[0]);
    EXPECT_EQ(all, static_cast<std::int64_t>(glimpses[0].depth.count()));
    EXPECT_EQ(temporal::sharedPoints(glimpses[0], glimpses[40]), 0);
    EXPECT_NEAR(static_cast<double>(temporal::sharedPoints(glimpses[0], glimpses[12])),
                0.5 * static_cast<double>(all), 0.05 * static_cast<double>(all));
}

}  // namespace
}  // namespace stx
