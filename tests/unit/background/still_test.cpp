#include "lib/background/still.hpp"

#include <gtest/gtest.h>

#include "lib/background/still_motion.hpp"
#include "lib/base/parallel.hpp"
#include "tests/unit/background/still_scene.hpp"

namespace stx {
namespace {

constexpr glm::ivec2 kStillSize(96, 64);

StillSettings methodOf(StillMethod method) {
    StillSettings s;
    s.method = method;
    return s;
}

StillBackground mustMakeStill(Result<StillBackground> made) {
    EXPECT_TRUE(made) << made.error().text();
    return made ? std::move(*made) : StillBackground{Rgba8Image(kStillSize.x, kStillSize.y), {}, 0};
}

/// A box that walks through the picture.
DrawnFrames walker(int frames = 40) {
    return {kStillSize, frames, [frames](int k) {
                return wallWithBox(kStillSize, k, {-20 + k * 130 / frames, 16, 18, 40});
            }};
}

/// A box that fidgets before one place for most of the time: the wall behind is seen in 14 of 40
/// frames, and nothing moves there then.
DrawnFrames fidget() {
    return {kStillSize, 40, [](int k) {
                const bool there = k % 20 < 13;
                return wallWithBox(kStillSize, k,
                                   {there ? 30 + k * 7 % 5 : -100, 16 + k * 5 % 4, 30, 30});
            }};
}

TEST(StillBackground, FramesThatAreNotOfTheirSizeAreRefused) {
    Job job;
    DrawnFrames small({40, 40}, 4, [](int) { return Rgba8Image(4, 4, {7, 7, 7, 255}); });
    DrawnFrames none({0, 0}, 4, [](int) { return Rgba8Image(); });
    for (const auto method : {StillMethod::select, StillMethod::median, StillMethod::n2pg}) {
        const auto wrong = stillBackground(small, methodOf(method), job);
        ASSERT_FALSE(wrong);
        EXPECT_EQ(wrong.error().code, ErrorCode::invalidInput);
        EXPECT_EQ(wrong.error().text(), "frame 0 is 4x4; 40x40 is expected");
        EXPECT_FALSE(stillBackground(none, methodOf(method), job));
    }
}

TEST(SpreadFrames, GoesFromTheFirstToTheLast) {
    EXPECT_EQ(spreadFrames(5, 0), (std::vector<int>{0, 1, 2, 3, 4}));
    EXPECT_EQ(spreadFrames(5, 9), (std::vector<int>{0, 1, 2, 3, 4}));
    EXPECT_EQ(spreadFrames(100, 3), (std::vector<int>{0, 50, 99}));
    EXPECT_EQ(spreadFrames(100, 2), (std::vector<int>{0, 99}));
    const auto many = spreadFrames(2000000000, 65535);
    EXPECT_EQ(many.front(), 0);
    EXPECT_EQ(many.back(), 1999999999);
    for (std::size_t i = 1; i < many.size(); ++i) ASSERT_LT(many[i - 1], many[i]);
}

TEST(StillBackground, EachMethodTakesAwayWhoWalksThrough) {
    for (const auto method : {StillMethod::select, StillMethod::n2pg, StillMethod::median}) {
        auto frames = walker();
        Job job;
        const auto made = mustMakeStill(stillBackground(frames, methodOf(method), job));
        const auto errors = backgroundErrors(made.colour, wall(kStillSize));
        EXPECT_LT(errors.age, 1.0) << static_cast<int>(method);
        EXPECT_LT(errors.peps, 0.01) << static_cast<int>(method);
        EXPECT_EQ(made.framesUsed, 40);
        for (const auto p : made.colour.pixels()) ASSERT_EQ(p.a, 255);
    }
}

TEST(StillBackground, SelectSeesBehindWhatCoversAPlaceMostOfTheTime) {
    Job job;
    const auto errors = [&](StillMethod method) {
        auto frames = fidget();
        StillSettings settings = methodOf(method);
        settings.quietest = 11;
        return backgroundErrors(mustMakeStill(stillBackground(frames, settings, job)).colour,
                                wall(kStillSize));
    };
    EXPECT_GT(errors(StillMethod::median).peps, 0.05) << "the scene is no longer hard";
    EXPECT_LT(errors(StillMethod::select).peps, 0.002);
}

/// Nothing moves in a frame that shows once more what the one before does.
TEST(StillBackground, FramesThatAreShownAgainDoNotTellWhatStandsStill) {
    constexpr int kFrames = 100;
    const auto passing = [](int k) {
        return wallWithBox(kStillSize, k, {k * 5 % 120 - 12, 24, 12, 16});
    };
    Job job;
    for (const auto method : {StillMethod::select, StillMethod::median, StillMethod::n2pg}) {
        SCOPED_TRACE(static_cast<int>(method));
        DrawnFrames damaged(kStillSize, kFrames, passing);
        for (int k = 30; k < 40; ++k) damaged.shown[k] = 29;
        damaged.shown[0] = damaged.shown[1] = damaged.shown[2] = 3;
        const auto made = mustMakeStill(stillBackground(damaged, methodOf(method), job));
        EXPECT_EQ(made.framesUsed, kFrames - 13);
        EXPECT_EQ(backgroundErrors(made.colour, wall(kStillSize)).peps, 0);
    }
    // Films that stood still for a while: in the middle, at the beginning for longer than frames
    // are looked at together, and at the end.
    for (const glm::ivec2 still : {glm::ivec2(29, 39), glm::ivec2(0, 24), glm::ivec2(80, 99)}) {
        SCOPED_TRACE(still.x);
        DrawnFrames frozen(kStillSize, kFrames, [&](int k) {
            return passing(k < still.x || k > still.y ? k : still.y);
        });
        const auto made = mustMakeStill(stillBackground(frozen, {}, job));
        EXPECT_EQ(made.framesUsed, kFrames);
        EXPECT_EQ(backgroundErrors(made.colour, wall(kStillSize)).peps, 0);
    }
    // Each frame is there twice, as in a film that was made for more frames in a second.
    DrawnFrames twice(kStillSize, kFrames, [&](int k) { return passing(k / 2); });
    EXPECT_EQ(
        backgroundErrors(mustMakeStill(stillBackground(twice, {}, job)).colour, wall(kStillSize))
            .peps,
        0);
    DrawnFrames same(kStillSize, 5, [&](int) { return passing(4); });
    EXPECT_EQ(mustMakeStill(stillBackground(same, {}, job)).colour, passing(4));
}

/// An even box that is too bright for the camera, and so without the noise of the wall, walks
/// through the picture: any pixel shows it in a sixth of the frames.
TEST(StillBackground, SelectDoesNotTakeWhatHasLessNoiseForWhatStandsStill) {
    DrawnFrames frames(kStillSize, 120, [](int k) {
        auto picture = wallWithBox(kStillSize, k, {-100, 0, 1, 1});
        for (int y = 20; y < 44; ++y)
            for (int x = std::max(0, k * 2 - 70); x < std::min(kStillSize.x, k * 2 - 30); ++x)
                picture.at(x, y) = glm::u8vec4(255);
        return picture;
    });
    Job job;
    StillSettings settings;
    const auto right = mustMakeStill(stillBackground(frames, settings, job));
    EXPECT_LT(backgroundErrors(right.colour, wall(kStillSize)).peps, 0.001);
    settings.adaptive = 0;
    const auto wrong = mustMakeStill(stillBackground(frames, settings, job));
    EXPECT_GT(backgroundErrors(wrong.colour, wall(kStillSize)).peps, 0.05) << "the scene is easy";
}

/// What was cut out of the frames has a colour that nobody sees.
TEST(StillBackground, TransparentPixelsAreNotLookedAt) {
    const auto cutOut = [](int always) {
        return DrawnFrames(kStillSize, 12, [always](int k) {
            auto picture = wallWithBox(kStillSize, k, {-100, 0, 1, 1});
            for (int y = 20; y < 40; ++y)
                for (int x = 10; x < 50; ++x)
                    if (k % 3 || x < always) picture.at(x, y) = glm::u8vec4(255, 0, 255, 0);
            return picture;
        });
    };
    Job job;
    for (const auto method : {StillMethod::select, StillMethod::median}) {
        auto frames = cutOut(0);
        const auto made = mustMakeStill(stillBackground(frames, methodOf(method), job));
        EXPECT_LT(backgroundErrors(made.colour, wall(kStillSize)).peps, 0.001);
        for (const auto p : made.colour.pixels()) ASSERT_EQ(p.a, 255);

        auto open = cutOut(30);
        const auto part = mustMakeStill(stillBackground(open, methodOf(method), job));
        EXPECT_EQ(part.colour.at(15, 30), glm::u8vec4(0));
        EXPECT_EQ(part.confidence.at(15, 30), 0);
        EXPECT_EQ(part.colour.at(35, 30).a, 255);
    }
    auto frames = cutOut(0);
    const auto made = stillBackground(frames, methodOf(StillMethod::n2pg), job);
    ASSERT_FALSE(made);
    EXPECT_EQ(made.error().code, ErrorCode::usage);
}

TEST(StillBackground, MedianOfAnEvenNumberIsTheMeanOfTheTwoInTheMiddle) {
    const int levels[] = {200, 10, 13, 0};  // sorted: 0 10 13 200
    DrawnFrames frames({2, 2}, 4, [&](int k) {
        return Rgba8Image(2, 2, glm::u8vec4(levels[k], 255 - levels[k], 7, 255));
    });
    Job job;
    const auto made = mustMakeStill(stillBackground(frames, methodOf(StillMethod::median), job));
    EXPECT_EQ(made.colour.at(1, 1), glm::u8vec4(12, 244, 7, 255));
    // Within 20 of it: three of four.
    EXPECT_EQ(made.confidence.at(1, 1), 191);
}

TEST(StillBackground, N2pgReplacesWhatLeavesAndIgnoresWhoStopsForAWhile) {
    Job job;
    // There from the beginning, gone after a fifth of the time.
    DrawnFrames leaves(kStillSize, 50, [](int k) {
        return wallWithBox(kStillSize, k, {k < 10 ? 30 : -100, 16, 30, 30});
    });
    EXPECT_LT(backgroundErrors(
                  mustMakeStill(stillBackground(leaves, methodOf(StillMethod::n2pg), job)).colour,
                  wall(kStillSize))
                  .peps,
              0.002);
    // Stops at the end, for less time than the wall was seen.
    DrawnFrames stops(kStillSize, 50, [](int k) {
        return wallWithBox(kStillSize, k, {k >= 32 ? 30 : -100, 16, 30, 30});
    });
    EXPECT_LT(backgroundErrors(
                  mustMakeStill(stillBackground(stops, methodOf(StillMethod::n2pg), job)).colour,
                  wall(kStillSize))
                  .peps,
              0.002);
}

TEST(StillBackground, N2pgFollowsTheLight) {
    Job job;
    // 30 levels in 60 frames.
    DrawnFrames frames(kStillSize, 60, [](int k) {
        auto picture = wallWithBox(kStillSize, k, {-100, 0, 1, 1});
        for (auto& p : picture.pixels())
            for (int c = 0; c < 3; ++c) p[c] = static_cast<std::uint8_t>(p[c] + k / 2);
        return picture;
    });
    const auto made = mustMakeStill(stillBackground(frames, methodOf(StillMethod::n2pg), job));
    auto last = wall(kStillSize);
    for (auto& p : last.pixels())
        for (int c = 0; c < 3; ++c) p[c] = static_cast<std::uint8_t>(p[c] + 29);
    EXPECT_LT(backgroundErrors(made.colour, last).age, 12);
    EXPECT_EQ(backgroundErrors(made.colour, last).peps, 0);
}

TEST(StillBackground, ConfidenceIsLowWhereFramesDisagree) {
    Job job;
    for (const auto method : {StillMethod::select, StillMethod::n2pg, StillMethod::median}) {
        auto frames = fidget();
        const auto made = mustMakeStill(stillBackground(frames, methodOf(method), job));
        EXPECT_GT(made.confidence.at(4, 60), 240) << static_cast<int>(method);
        EXPECT_LT(made.confidence.at(45, 30), 200) << static_cast<int>(method);
    }
}

TEST(StillBackground, IsTheSameOnAnyNumberOfThreadsAndInBandsOfAnyHeight) {
    for (const auto method : {StillMethod::select, StillMethod::n2pg, StillMethod::median}) {
        for (const bool drift : {false, true}) {
            StillSettings settings = methodOf(method);
            settings.drift = drift;
            std::optional<StillBackground> first;
            int reads = 0;
            for (const int threads : {1, 2, 7}) {
                for (const std::uint64_t memory : {4ull << 30, 1ull << 20}) {
                    const ThreadLimit limit(threads);
                    Job job;
                    job.limits.maxMemoryBytes = memory;
                    auto frames = fidget();
                    const auto made = mustMakeStill(stillBackground(frames, settings, job));
                    reads = frames.reads;
                    if (!first) first = made;
                    EXPECT_TRUE(made.colour == first->colour);
                    EXPECT_TRUE(made.confidence == first->confidence);
                }
            }
            // Little memory: in bands, and not all frames could be kept.
            if (method == StillMethod::select) {
                EXPECT_GT(reads, 80);
            }
        }
    }
}

TEST(StillBackground, ReadsEachFrameOnceWhenAllCanBeKept) {
    for (const auto method : {StillMethod::select, StillMethod::n2pg, StillMethod::median}) {
        const ThreadLimit one(1);
        auto frames = walker();
        Job job;
        mustMakeStill(stillBackground(frames, methodOf(method), job));
        EXPECT_EQ(frames.reads, 40) << static_cast<int>(method);
        StillSettings few = methodOf(method);
        few.frames = 10;
        auto again = walker();
        EXPECT_EQ(mustMakeStill(stillBackground(again, few, job)).framesUsed, 10);
        EXPECT_EQ(again.reads, 10) << static_cast<int>(method);
    }
}

TEST(StillBackground, WorksOnPicturesOfOnePixelAndOneRow) {
    for (const auto method : {StillMethod::select, StillMethod::n2pg, StillMethod::median}) {
        for (const glm::ivec2 size : {glm::ivec2(1, 1), glm::ivec2(9, 1), glm::ivec2(1, 9)}) {
            DrawnFrames frames(size, 3, [&](int) {
                return Rgba8Image(size.x, size.y, glm::u8vec4(9, 90, 200, 255));
            });
            Job job;
            const auto made = mustMakeStill(stillBackground(frames, methodOf(method), job));
            EXPECT_EQ(made.colour.at(0, 0), glm::u8vec4(9, 90, 200, 255));
        }
    }
}

TEST(StillBackground, ErrorsSayWhatIsWrong) {
    Job job;
    DrawnFrames one(kStillSize, 1, [](int) { return wall(kStillSize); });
    const auto alone = stillBackground(one, {}, job);
    ASSERT_FALSE(alone);
    EXPECT_EQ(alone.error().code, ErrorCode::invalidInput);
    EXPECT_NE(alone.error().message.find("at least 2 frames"), std::string::npos);

    for (const auto method : {StillMethod::select, StillMethod::n2pg, StillMethod::median}) {
        auto broken = walker();
        broken.broken = {31, 17, 18};
        const auto made = stillBackground(broken, methodOf(method), job);
        ASSERT_FALSE(made);
        EXPECT_EQ(made.error().message, "frame 17 is broken");

        Job small;
        small.limits.maxMemoryBytes = 1000;
        auto frames = walker();
        const auto tooLarge = stillBackground(frames, methodOf(method), small);
        ASSERT_FALSE(tooLarge);
        EXPECT_EQ(tooLarge.error().message.find("raise") == std::string::npos, false)
            << tooLarge.error().message;

        Job stopped;
        stopped.cancelled = true;
        EXPECT_FALSE(stillBackground(frames, methodOf(method), stopped));
    }
    auto frames = walker();
    for (const auto change :
         {+[](StillSettings& s) { s.frames = 1; }, +[](StillSettings& s) { s.quietest = 0; },
          +[](StillSettings& s) { s.quietest = 256; },
          +[](StillSettings& s) { s.windowDivisor = 0; },
          +[](StillSettings& s) { s.adaptive = -1; }}) {
        StillSettings settings;
        change(settings);
        const auto made = stillBackground(frames, settings, job);
        ASSERT_FALSE(made);
        EXPECT_EQ(made.error().code, ErrorCode::usage);
    }
    DrawnFrames many(kStillSize, 70000, [](int) { return wall(kStillSize); });
    const auto tooMany = stillBackground(many, {}, job);
    ASSERT_FALSE(tooMany);
    EXPECT_NE(tooMany.error().message.find("--frames"), std::string::npos);
}

/// Sums of a window by their definition.
std::uint32_t plainQuantity(const Rgba8Image& a, const Rgba8Image& b, int x, int y, int radius,
                            MotionScore score) {
    const auto change = [&](int u, int v) { return stillLuma(b.at(u, v)) - stillLuma(a.at(u, v)); };
    std::uint32_t sum = 0;
    for (int v = std::max(0, y - radius); v <= std::min(a.height() - 1, y + radius); ++v) {
        for (int u = std::max(0, x - radius); u <= std::min(a.width() - 1, x + radius); ++u) {
            if (score == MotionScore::luma) {
                sum += static_cast<std::uint32_t>(std::abs(change(u, v)));
                continue;
            }
            if (u + 1 < a.width())
                sum += static_cast<std::uint32_t>(std::abs(change(u + 1, v) - change(u, v)));
            if (v + 1 < a.height())
                sum += static_cast<std::uint32_t>(std::abs(change(u, v + 1) - change(u, v)));
        }
    }
    return sum;
}

TEST(MotionWindow, SumsWhatItsDefinitionSums) {
    const glm::ivec2 size(37, 29);
    const auto a = wallWithBox(size, 0, {5, 5, 10, 10});
    const auto b = wallWithBox(size, 1, {9, 7, 10, 10});
    for (const auto score : {MotionScore::luma, MotionScore::gradient}) {
        for (const int divisor : {1, 3, 6, 40}) {
            const MotionWindow window(size.x, size.y, divisor, score);
            for (const glm::ivec2 band : {glm::ivec2(0, 29), glm::ivec2(7, 5), glm::ivec2(28, 1)}) {
                LumaRows before, now;
                const int from = window.firstNeeded(band.x);
                const int rows = window.rowsNeeded(band.x, band.y);
                before.take(a, from, rows);
                now.take(b, from, rows);
                std::vector<std::uint32_t> got(static_cast<std::size_t>(band.y) * size.x);
                window.quantities(before, now, band.x, band.y, got);
                for (int y = 0; y < band.y; ++y)
                    for (int x = 0; x < size.x; ++x)
                        ASSERT_EQ(got[static_cast<std::size_t>(y) * size.x + x],
                                  plainQuantity(a, b, x, band.x + y, 29 / divisor / 2, score))
                            << x << " " << band.x + y;
            }
        }
    }
}

TEST(MotionWindow, GradientsDoNotSeeTheLightChange) {
    const auto a = wall(kStillSize);
    auto b = a;
    for (auto& p : b.pixels())
        for (int c = 0; c < 3; ++c) p[c] = static_cast<std::uint8_t>(p[c] + 9);
    const auto largest = [&](MotionScore score) {
        const MotionWindow window(kStillSize.x, kStillSize.y, 6, score);
        LumaRows before, now;
        before.take(a, 0, kStillSize.y);
        now.take(b, 0, kStillSize.y);
        std::vector<std::uint32_t> got(a.count());
        window.quantities(before, now, 0, kStillSize.y, got);
        return *std::max_element(got.begin(), got.end());
    };
    EXPECT_EQ(largest(MotionScore::gradient), 0u);
    EXPECT_EQ(largest(MotionScore::luma), 9u * 11 * 11);
}

TEST(ForegroundMask, IsWhatStandsBeforeTheBackground) {
    const glm::ivec2 size(200, 150);
    const auto frame = wallWithBox(size, 3, {60, 40, 50, 70});
    const auto mask = foregroundMask(wall(size), frame);
    ASSERT_TRUE(mask) << mask.error().text();
    int wrong = 0;
    for (int y = 0; y < size.y; ++y) {
        for (int x = 0; x < size.x; ++x) {
            ASSERT_TRUE(mask->at(x, y) == 0 || mask->at(x, y) == 255);
            const bool box = x >= 60 && x < 110 && y >= 40 && y < 110;
            wrong += (mask->at(x, y) == 255) != box;
        }
    }
    EXPECT_LE(wrong, 35);
}

TEST(ForegroundMask, LeavesOutNoiseAndSpecksAndSeesThingsThatFillMostOfThePicture) {
    const glm::ivec2 size(200, 150);
    auto frame = wallWithBox(size, 3, {-9, 0, 1, 1});
    frame.at(20, 20) = {255, 0, 255, 255};
    const auto none = foregroundMask(wall(size), frame);
    for (const auto p : none->pixels()) ASSERT_EQ(p, 0);
    const auto most = foregroundMask(wall(size), wallWithBox(size, 3, {0, 0, 140, 150}));
    int white = 0;
    for (const auto p : most->pixels()) white += p == 255;
    EXPECT_NEAR(white, 140 * 150, 400);
}

TEST(ForegroundMask, ErrorWhenSizesDiffer) {
    const auto mask = foregroundMask(wall({10, 10}), wall({10, 11}));
    ASSERT_FALSE(mask);
    EXPECT_EQ(mask.error().message,
              "the background is 10x10, but the frame is 10x11; both must match");
}

}  // namespace
}  // namespace stx
