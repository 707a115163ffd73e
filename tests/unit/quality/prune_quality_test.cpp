#include "lib/quality/prune_quality.hpp"

#include <gtest/gtest.h>

#include "tests/torus_bundle.hpp"

namespace stx {
namespace {

/// The largest budget, in steps of a percent, that prune() meets only with a note; 0 = none.
std::int64_t tightBudget(const Bundle& whole) {
    for (int percent = 99; percent > 0; --percent) {
        Job job;
        Bundle bundle = whole;
        PruneSettings settings;
        settings.budget = whole.pointCount() * percent / 100;
        if (!prune(bundle, settings, job)) return 0;
        if (!job.takeNotes().empty()) return settings.budget;
    }
    return 0;
}

TEST(PruneQuality, NotesOfAttemptsThatWereGivenUpAreNotPassedOn) {
    const Bundle whole = torusViews(96);
    PruneSettings settings;
    settings.budget = tightBudget(whole);
    ASSERT_GT(settings.budget, 0);
    Job job;
    Bundle tried = whole;
    ASSERT_TRUE(prune(tried, settings, job));
    const auto notesOfOne = job.takeNotes();
    ASSERT_EQ(notesOfOne.size(), 1u);

    // Nothing reaches 120 dB: no attempt's note counts.
    job.note("said before");
    Bundle bundle = whole;
    ASSERT_FALSE(pruneToQuality(bundle, settings, 120, job));
    EXPECT_EQ(job.takeNotes(), std::vector<std::string>{"said before"});

    // The attempt that is kept has its own.
    ASSERT_TRUE(pruneToQuality(bundle, settings, 1, job));
    EXPECT_EQ(job.takeNotes(), notesOfOne);
}

TEST(PruneQuality, NoQualityAtAllIsAWishToo) {
    const Bundle whole = torusViews(96);
    Job job;
    Bundle none = whole, hardlyAny = whole;
    const auto atZero = pruneToQuality(none, {}, 0, job);
    const auto above = pruneToQuality(hardlyAny, {}, 0.001, job);
    ASSERT_TRUE(atZero) << atZero.error().message;
    ASSERT_TRUE(above) << above.error().message;
    EXPECT_LT(atZero->keptPixels, atZero->sourcePixels);
    EXPECT_EQ(atZero->keptPixels, above->keptPixels);
    const auto below = pruneToQuality(none, {}, -1, job);
    ASSERT_FALSE(below);
    EXPECT_EQ(below.error().message, "the least PSNR is -1 dB; it must be 0 or more");
}

}  // namespace
}  // namespace stx
