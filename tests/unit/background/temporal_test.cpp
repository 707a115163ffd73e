// The background that is remembered, on small scenes whose every pixel is known.

#include <gtest/gtest.h>

#include "lib/background/sequence_background.hpp"
#include "lib/base/parallel.hpp"
#include "lib/model/linear_views.hpp"
#include "tests/wall_with_block.hpp"

namespace stx {
namespace {

using test::kHeight, test::kWall, test::kWidth, test::wallColour, test::wallWithBlock;

using Film = std::function<ReferenceView(int)>;

Result<BackgroundModel> modelOf(const Film& film, int count, Job& job,
                                const TemporalBackgroundSettings& settings = {}) {
    STX_TRY(auto background, TemporalBackground::start(film(0), settings, job));
    for (int pass = 0; pass < background.passes(); ++pass) {
        for (int i = 0; i < count; ++i) STX_CHECK(background.add(film(i), i * 0.04, job));
        STX_CHECK(background.endPass(job));
    }
    return background.finish(job);
}

/// Pixels that are the wall, exactly.
int wallPixels(const ReferenceView& view) {
    int count = 0;
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x)
            count += view.depth.at(x, y) == kWall &&
                     view.texture.rgba8()->at(x, y) == glm::u8vec4(wallColour(x, y), 255);
    return count;
}

TEST(TemporalBackground, WhoStandsStillForMostOfTheTimeIsNotTakenIn) {
    // In 26 of 30 frames the block is in the middle.
    const Film film = [](int i) {
        return i < 26 ? wallWithBlock(18, 30, 2.0f) : wallWithBlock(2, 12, 2.0f);
    };
    Job job;
    const auto model = modelOf(film, 30, job);
    ASSERT_TRUE(model) << model.error().text();
    EXPECT_EQ(wallPixels(model->view), kWidth * kHeight);
    EXPECT_TRUE(model->view.background);
    EXPECT_EQ(model->frames, 30);
    EXPECT_NEAR(model->confidence.at(24, 20), 4.0f / 30, 1e-6f);
    EXPECT_NEAR(model->lastSeen.at(24, 20), 29 * 0.04f, 1e-6f);
    EXPECT_EQ(model->confidence.at(24, 2), 1.0f);
}

TEST(TemporalBackground, WhatWasNeverSeenIsEmpty) {
    // The block turns on the spot: its middle never moves away.
    const Film film = [](int i) {
        return wallWithBlock(18 - i % 6, 30 + i % 6, 2.0f + 0.004f * static_cast<float>(i % 6));
    };
    Job job;
    const auto model = modelOf(film, 24, job);
    ASSERT_TRUE(model) << model.error().text();
    for (int y = 8; y < kHeight; ++y) {
        for (int x = 18; x < 30; ++x) {
            ASSERT_FALSE(hasPoint(model->view.depth.at(x, y))) << x << ' ' << y;
            ASSERT_EQ(model->view.texture.rgba8()->at(x, y).a, 0);
            ASSERT_EQ(model->confidence.at(x, y), 0.0f);
        }
    }
    // But for single pixels at its corners, the wall around it is known.
    EXPECT_GE(wallPixels(model->view), kWidth * kHeight - 12 * (kHeight - 8) - 12);
}

TEST(TemporalBackground, AnObjectInEmptySpaceLeavesNothing) {
    const Film film = [](int i) {
        ReferenceView view = wallWithBlock(2 + i, 14 + i, 2.0f);
        for (std::size_t p = 0; p < view.depth.count(); ++p) {
            if (view.depth.data()[p] < kWall) continue;
            view.depth.data()[p] = kNoDepth;
            view.texture.rgba8()->data()[p].a = 0;
        }
        return view;
    };
    Job job;
    const auto model = modelOf(film, 30, job);
    ASSERT_TRUE(model) << model.error().text();
    EXPECT_EQ(model->view.pointCount(), 0);
}

TEST(TemporalBackground, ColoursAreThoseWithoutShadow) {
    // A shadow lies on the right quarter in 12 of 30 frames.
    const Film film = [](int i) {
        ReferenceView view = wallWithBlock(0, 0, 2.0f);
        for (int y = 0; i > 8 && i <= 20 && y < kHeight; ++y) {
            for (int x = kWidth * 3 / 4; x < kWidth; ++x) {
                glm::u8vec4& c = view.texture.rgba8()->at(x, y);
                c = glm::u8vec4(glm::u8vec3(glm::vec3(c) * 0.8f), 255);
            }
        }
        return view;
    };
    Job job;
    const auto model = modelOf(film, 30, job);
    ASSERT_TRUE(model) << model.error().text();
    int worst = 0;
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x)
            for (int c = 0; c < 3; ++c)
                worst = std::max(worst, std::abs(model->view.texture.rgba8()->at(x, y)[c] -
                                                 wallColour(x, y)[c]));
    EXPECT_LE(worst, 1);
}

TEST(TemporalBackground, LightThatDriftsIsEvenedOut) {
    const Film film = [](int i) {
        const float light = 1 + 0.04f * std::sin(0.2f * static_cast<float>(i));
        return wallWithBlock(i, i + 10, 2.0f, light);
    };
    double mean = 0;
    for (int i = 0; i < 36; ++i) mean += (1 + 0.04 * std::sin(0.2 * i)) / 36;
    Job job;
    const auto model = modelOf(film, 36, job);
    ASSERT_TRUE(model) << model.error().text();
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x)
            for (int c = 0; c < 3; ++c)
                ASSERT_NEAR(model->view.texture.rgba8()->at(x, y)[c], wallColour(x, y)[c] * mean,
                            2.0)
                    << x << ' ' << y;
}

TEST(TemporalBackground, LinearLightIsKept) {
    const Film film = [](int i) {
        ReferenceView view = wallWithBlock(i, i + 12, 2.0f);
        RgbaFloatImage floats(kWidth, kHeight);
        for (std::size_t p = 0; p < floats.count(); ++p)
            floats.data()[p] = view.texture.at(p) * glm::vec4(3, 3, 3, 1);
        view.texture = std::move(floats);
        return view;
    };
    Job job;
    const auto model = modelOf(film, 30, job);
    ASSERT_TRUE(model) << model.error().text();
    ASSERT_TRUE(model->view.texture.isLinear());
    for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
            const glm::vec3 truth = 3.0f / 255.0f * glm::vec3(wallColour(x, y));
            const glm::vec3 found(model->view.texture.rgbaFloat()->at(x, y));
            ASSERT_LT(glm::length(found - truth), 0.01f * glm::length(truth)) << x << ' ' << y;
        }
    }
}

TEST(TemporalBackground, IsTheSameOnAnyThreadsAndInAnyNumberOfPasses) {
    const Film film = [](int i) {
        ReferenceView view = wallWithBlock(i, i + 14, 2.0f + 0.01f * static_cast<float>(i));
        for (std::size_t p = 0; p < view.depth.count(); ++p) {
            const auto noise = static_cast<int>((p * 2654435761u + i * 40503u) >> 8 & 7);
            view.depth.data()[p] *= 1 + 0.0005f * static_cast<float>(noise - 4);
            view.texture.rgba8()->data()[p].g =
                static_cast<std::uint8_t>(view.texture.rgba8()->data()[p].g + noise - 4);
        }
        return view;
    };
    std::optional<BackgroundModel> first;
    for (const int threads : {1, 2, 7}) {
        for (const int rows : {0, 11}) {
            const ThreadLimit limit(threads);
            Job job;
            if (rows)
                job.limits.maxMemoryBytes =
                    kWidth * (kHeight * 36 + rows * TemporalBackground::kBytesPerPixel);
            const auto passes = TemporalBackground::start(film(0), {}, job);
            ASSERT_TRUE(passes) << passes.error().text();
            EXPECT_EQ(passes->passes(), rows ? 4 : 1);
            auto model = modelOf(film, 24, job);
            ASSERT_TRUE(model) << model.error().text();
            if (!first)
                first = std::move(*model);
            else {
                EXPECT_EQ(model->view.depth, first->view.depth);
                EXPECT_EQ(model->view.texture, first->view.texture);
                EXPECT_EQ(model->confidence, first->confidence);
                EXPECT_EQ(model->lastSeen, first->lastSeen);
            }
        }
    }
}

TEST(TemporalBackground, SaysWhatItCannotUse) {
    Job job;
    const auto after = [&](const ReferenceView& frame, double time) {
        auto background = TemporalBackground::start(wallWithBlock(0, 0, 2), {}, job);
        EXPECT_TRUE(background->add(wallWithBlock(0, 0, 2), 1.0, job));
        const auto added = background->add(frame, time, job);
        return added ? std::string() : added.error().message;
    };
    const ReferenceView good = wallWithBlock(3, 8, 2);
    EXPECT_EQ(after(good, 1.5), "");
    EXPECT_EQ(after(good, 1.0), "the frame is of 1 s, the one before of 1 s");
    ReferenceView moved = good;
    moved.camera.position.x += 0.1;
    EXPECT_EQ(after(moved, 2),
              "the camera moved; a background that remembers needs a still camera");
    ReferenceView linear = good;
    linear.texture = RgbaFloatImage(kWidth, kHeight);
    EXPECT_EQ(after(linear, 2), "the frame has linear colours, those before have sRGB ones");
    auto none = TemporalBackground::start(good, {}, job);
    EXPECT_FALSE(none->endPass(job));
    job.limits.maxMemoryBytes = 1000;
    EXPECT_FALSE(TemporalBackground::start(good, {}, job));
}

TEST(RememberBackgrounds, OfEachCamera) {
    // The second camera moves by whole pixels of the wall, the third sees nothing that stays.
    const auto read = [](std::size_t frame, Job&) -> Result<Bundle> {
        const int i = static_cast<int>(frame);
        Bundle bundle;
        bundle.views = {wallWithBlock(i, i + 12, 2.0f), wallWithBlock(i, i + 12, 2.0f),
                        wallWithBlock(2 + i, 14 + i, 2.0f)};
        bundle.views[1].name = "hand held";
        const int steps = i / 8;
        bundle.views[1].camera.position.x = steps * kWall / bundle.views[1].camera.fx;
        for (int y = 0; y < kHeight; ++y)
            for (int x = 0; x < kWidth; ++x)
                if (bundle.views[1].depth.at(x, y) == kWall)
                    bundle.views[1].texture.rgba8()->at(x, y) =
                        glm::u8vec4(wallColour(x + steps, y), 255);
        bundle.views[2].name = "studio";
        ReferenceView& studio = bundle.views[2];
        for (std::size_t p = 0; p < studio.depth.count(); ++p) {
            if (studio.depth.data()[p] < kWall) continue;
            studio.depth.data()[p] = kNoDepth;
            studio.texture.rgba8()->data()[p].a = 0;
        }
        return bundle;
    };
    std::vector<double> times;
    for (int i = 0; i < 30; ++i) times.push_back(i * 0.04);
    std::optional<Image<float>> first;
    for (const std::uint64_t memory :
         {std::uint64_t{0}, std::uint64_t{3 * 48 * (36 * 36 + 2400)}}) {
        Job job;
        TemporalBackgroundSettings settings;
        settings.maxMemoryBytes = memory;
        const auto models = rememberBackgrounds(times, read, settings, job);
        ASSERT_TRUE(models) << models.error().text();
        // The one that moves sees three columns more on its way than any pose of it.
        ASSERT_EQ(models->size(), 3u);
        EXPECT_EQ(models->front().view.name, "camera background");
        EXPECT_EQ((*models)[1].view.name, "hand held background");
        EXPECT_EQ(models->back().view.name, "hand held background 2");
        EXPECT_GT(models->back().view.pointCount(), kWidth * kHeight * 9 / 10);
        EXPECT_EQ(wallPixels(models->front().view), kWidth * kHeight);
        EXPECT_EQ(job.takeNotes(),
                  (std::vector<std::string>{
                      "nothing stays behind what moves in view 'studio'; it gets no background"}));
        if (!first) first = models->front().view.depth;
        EXPECT_EQ(models->front().view.depth, *first);
    }
    Job job;
    EXPECT_FALSE(rememberBackgrounds({}, read, {}, job));
    const auto fewer = [&](std::size_t frame, Job& j) {
        auto bundle = read(frame, j);
        if (frame == 3) bundle->views.pop_back();
        return bundle;
    };
    const auto changed = rememberBackgrounds(times, fewer, {}, job);
    ASSERT_FALSE(changed);
    EXPECT_EQ(changed.error().text(), "frame 3: there are 2 views where the first frame has 3");
}

TEST(RememberBackgrounds, OfFramesOfBothKindsOfColourAreThoseOfLinearLight) {
    // The first camera stands still, the second moves.
    const auto film = [](const std::function<bool(std::size_t frame)>& linear) {
        return [linear](std::size_t frame, Job&) -> Result<Bundle> {
            const int i = static_cast<int>(frame);
            Bundle bundle;
            bundle.views = {wallWithBlock(i, i + 12, 2.0f), wallWithBlock(i, i + 12, 2.0f)};
            bundle.views[1].name = "hand held";
            bundle.views[1].camera.position.x = i / 8 * kWall / bundle.views[1].camera.fx;
            if (linear(frame)) std::ranges::for_each(bundle.views, makeLinear);
            return bundle;
        };
    };
    std::vector<double> times;
    for (int i = 0; i < 20; ++i) times.push_back(i * 0.04);
    Job job;
    const auto expected = rememberBackgrounds(times, film([](auto) { return true; }), {}, job);
    ASSERT_TRUE(expected) << expected.error().text();
    ASSERT_GE(expected->size(), 2u);
    const std::function<bool(std::size_t)> kinds[] = {[](auto frame) { return frame > 0; },
                                                      [](auto frame) { return frame != 7; },
                                                      [](auto frame) { return frame == 19; }};
    for (const auto& kind : kinds) {
        const auto found = rememberBackgrounds(times, film(kind), {}, job);
        ASSERT_TRUE(found) << found.error().text();
        ASSERT_EQ(found->size(), expected->size());
        for (std::size_t k = 0; k < found->size(); ++k) {
            EXPECT_TRUE((*found)[k].view.texture.isLinear());
            EXPECT_EQ((*found)[k].view.texture, (*expected)[k].view.texture);
            EXPECT_EQ((*found)[k].view.depth, (*expected)[k].view.depth);
        }
    }
    // An error of reading stays what it is.
    const auto broken = [&](std::size_t frame, Job& part) -> Result<Bundle> {
        if (frame == 9) return fail(ErrorCode::io, "gone");
        return film(kinds[0])(frame, part);
    };
    const auto failed = rememberBackgrounds(times, broken, {}, job);
    ASSERT_FALSE(failed);
    EXPECT_EQ(failed.error().text(), "gone");
}

}  // namespace
}  // namespace stx
