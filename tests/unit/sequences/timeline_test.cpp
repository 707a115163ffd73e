#include <limits>

#include <gtest/gtest.h>

#include "lib/model/sequence.hpp"

using namespace stx;

TEST(Timeline, ShowsTheLastFrameThatHasBegun) {
    Timeline line;
    line.times = {0, 0.04, 0.1};
    line.end = 0.2;
    EXPECT_EQ(line.frameAt(-1), 0u);
    EXPECT_EQ(line.frameAt(0), 0u);
    EXPECT_EQ(line.frameAt(0.0399), 0u);
    EXPECT_EQ(line.frameAt(0.04), 1u);
    EXPECT_EQ(line.frameAt(0.0999), 1u);
    EXPECT_EQ(line.frameAt(5), 2u);
    EXPECT_DOUBLE_EQ(line.durationOf(0), 0.04);
    EXPECT_DOUBLE_EQ(line.durationOf(2), 0.1);
}

TEST(Timeline, FindsTheRateAndTheTicksOfFilms) {
    EXPECT_DOUBLE_EQ(steadyTimeline(16, 25).rate(), 25);
    EXPECT_EQ(steadyTimeline(16, 25).timescale(), 1000u);
    EXPECT_EQ(steadyTimeline(48, 24).timescale(), 24000u);
    EXPECT_EQ(steadyTimeline(48, 30000.0 / 1001).timescale(), 30000u);
    Timeline irregular;
    irregular.times = {0, 0.0331234, 0.0668888};
    irregular.end = 0.1;
    EXPECT_EQ(irregular.rate(), 0);
    EXPECT_EQ(irregular.timescale(), 1000000u);
    EXPECT_EQ(Timeline().rate(), 0) << "what stands still has no rate";
}

TEST(Timeline, RefusesTimesThatDoNotAscend) {
    Timeline line;
    line.times = {0, 0.04, 0.04};
    line.end = 1;
    EXPECT_FALSE(line.check());
    line.times = {-1, 0};
    EXPECT_TRUE(line.check()) << "clocks may begin anywhere";
    line.times = {0, std::numeric_limits<double>::infinity()};
    EXPECT_FALSE(line.check());
    line.times = {0, 2};
    EXPECT_FALSE(line.check()) << "ends before its last frame";
    line.end = 3;
    EXPECT_TRUE(line.check());
    line.times.clear();
    EXPECT_FALSE(line.check());
}

TEST(Sequences, SomeFramesKeepTheirTimes) {
    class Numbers : public Sequence {
      public:
        Numbers() { timeline_ = steadyTimeline(10, 10); }
        Result<Bundle> frame(std::size_t index, Job&) override {
            Bundle bundle;
            bundle.title = std::to_string(index);
            return bundle;
        }
    };
    Job job;
    auto some = someFrames(std::make_unique<Numbers>(), {3, 4, 8});
    ASSERT_TRUE(some);
    EXPECT_EQ((*some)->timeline().times.size(), 3u);
    EXPECT_NEAR((*some)->timeline().times[2], 0.8, 1e-12);
    EXPECT_NEAR((*some)->timeline().duration(), 0.6, 1e-12);
    const auto last = (*some)->frame(2, job);
    ASSERT_TRUE(last);
    EXPECT_EQ(last->title, "8");
    EXPECT_NEAR(*last->time, 0.8, 1e-12);
    EXPECT_FALSE(someFrames(std::make_unique<Numbers>(), {10}));
    EXPECT_FALSE(someFrames(std::make_unique<Numbers>(), {4, 3}));
    EXPECT_FALSE(someFrames(std::make_unique<Numbers>(), {}));
}
