// Which OpenEXR files say what is known of their views.
#include <gtest/gtest.h>

#include "formats/any/open.hpp"
#include "formats/any/save.hpp"
#include "formats/any/sequences.hpp"
#include "lib/render/factory.hpp"
#include "lib/surface/normals.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/torus_bundle.hpp"

namespace stx {
namespace {

using enum SaveOptions::Summaries;

class Summaries : public ::testing::Test {
  protected:
    /// Those that a file has after its views were written.
    std::vector<ViewSummary> written(const ViewTable& table,
                                     SaveOptions::Summaries kept = ofExact) {
        Job job;
        SaveOptions options;
        options.summaries = kept;
        const auto saved = saveViews(table, folder_ / "a.exr", options, job);
        EXPECT_TRUE(saved) << saved.error().text();
        const auto read = openViews(folder_ / "a.exr", {}, job);
        EXPECT_TRUE(read);
        return (*read)->summaries();
    }
    std::vector<ViewSummary> written(const Bundle& bundle, SaveOptions::Summaries kept = ofExact) {
        return written(*viewsOf(bundle), kept);
    }

    TemporaryFolder folder_;
    const Bundle exact_ = torusViews(96);
};

TEST_F(Summaries, AreThoseOfTheirViews) {
    const auto found = written(exact_);
    ASSERT_EQ(found.size(), exact_.views.size());
    for (std::size_t i = 0; i < found.size(); ++i)
        EXPECT_EQ(found[i], summaryOfView(exact_.views[i]));
    EXPECT_EQ(written(exact_, known), found);
    EXPECT_TRUE(written(exact_, none).empty());
}

TEST_F(Summaries, AreOfViewsThatRefiningLeavesAsTheyAre) {
    Bundle other = exact_;
    for (glm::u8vec4& p : other.views[3].texture.rgba8()->pixels())
        for (int k = 0; k < 3; ++k) p[k] = static_cast<std::uint8_t>(p[k] * 0.7);
    EXPECT_TRUE(written(other).empty());
    // Who knows better need not look.
    EXPECT_EQ(written(other, known).size(), other.views.size());
}

TEST_F(Summaries, AreOfNoViewsThatDoNotTell) {
    const auto none = [&](auto&& change) {
        Bundle other = exact_;
        change(other.views[3]);
        return written(other, known).empty();
    };
    EXPECT_FALSE(none([](ReferenceView&) {}));
    EXPECT_TRUE(none([](ReferenceView& v) { v.noDepth = NoDepth::unknown; }));
    EXPECT_TRUE(none([](ReferenceView& v) { v.background = true; }));
    EXPECT_TRUE(none([](ReferenceView& v) { v.refined = {"noise", 0.01f}; }));
}

TEST_F(Summaries, PassThroughWhatKeepsPixels) {
    const std::size_t count = written(exact_).size();
    Job job;
    int asked = 0;
    const auto open = [&] {
        auto table = openViews(folder_ / "a.exr", {}, job);
        EXPECT_TRUE(table);
        return watchedViews(std::move(*table), [&](std::size_t, const ReferenceView&) { ++asked; });
    };
    const auto change = bakeOfViews({});
    ASSERT_TRUE(change);
    const auto baked = changedViews(open(), *change);
    EXPECT_EQ(baked->summaries().size(), count);
    SaveOptions options;
    ASSERT_TRUE(saveViews(*baked, folder_ / "b.exr", options, job));
    // Each view was read once: nothing had to be looked for.
    EXPECT_EQ(asked, static_cast<int>(count));
    ViewChange other = *change;
    other.keepsPixels = false;
    EXPECT_TRUE(changedViews(open(), other)->summaries().empty());
}

TEST_F(Summaries, AreLeftAwayWhereTheyDoNotFitMemory) {
    Job job;
    const auto table = viewsOf(exact_);
    job.limits.maxMemoryBytes = table->bytesHeld() + 20 * table->pixelsOf(0);
    ASSERT_TRUE(saveViews(*table, folder_ / "few.exr", {}, job));
    const auto read = openViews(folder_ / "few.exr", {}, job);
    ASSERT_TRUE(read);
    EXPECT_TRUE((*read)->summaries().empty());
}

TEST_F(Summaries, AreNotOfFramesOfFilms) {
    Job job;
    const auto frames = sequenceOf(exact_);
    ASSERT_TRUE(saveSequence(*frames, folder_ / "f_%d.exr", {}, job));
    const auto read = openViews(folder_ / "f_0.exr", {}, job);
    ASSERT_TRUE(read);
    EXPECT_TRUE((*read)->summaries().empty());
}

}  // namespace
}  // namespace stx
