// Each N-th moment of a set that moves, where one is left of it and where pictures are missing.

#include "tests/unit/sequences/shots.hpp"

using namespace stx;
using namespace shots;

namespace {

/// Six pictures of one camera, a tenth of a second apart, without the files of some.
std::filesystem::path writeSix(const TemporaryFolder& folder, std::initializer_list<int> missing) {
    std::vector<Shot> six;
    for (int i = 0; i < 6; ++i) six.push_back({"a", 0.1 * i, 0, i});
    const auto set = writeShots(folder, six);
    for (const int i : missing) std::filesystem::remove(folder / fmt::format("c{}.png", i));
    return set;
}

ImageSetOptions everyNth(int every) {
    ImageSetOptions options;
    options.every = every;
    return options;
}

}  // namespace

TEST(EveryMoment, OfWhichOneIsLeftIsThatMoment) {
    TemporaryFolder folder;
    const auto set = writeSix(folder, {});
    for (const int every : {6, 10}) {
        const auto sequence = opened(set, everyNth(every));
        ASSERT_TRUE(sequence);
        EXPECT_EQ(sequence->timeline().count(), 1u);
        Job job;
        const auto bundle = sequence->frame(0, job);
        ASSERT_TRUE(bundle) << bundle.error().text();
        ASSERT_EQ(bundle->views.size(), 1u);
        EXPECT_EQ(bundle->views[0].name, "a");
        EXPECT_NEAR(bundle->views[0].depth.at(3, 3), 1.0, 1e-4);
        EXPECT_EQ(imageSetFrameCount(set, everyNth(every), job), 1);
        const auto asked = readImageSet(set, everyNth(every), job);
        ASSERT_TRUE(asked) << asked.error().text();
        EXPECT_EQ(asked->views.size(), 1u);
    }
}

TEST(EveryMoment, OfTwoCamerasOfWhichOneIsLeftHasAViewOfEach) {
    TemporaryFolder folder;
    const auto set = writeShots(
        folder, {{"a", 0, 0, 1}, {"b", 0, 1, 2}, {"a", 1, 0, 3}, {"b", 1, 1, 4}, {"a", 2, 0, 5}});
    Job job;
    const auto bundle = readImageSet(set, everyNth(3), job);
    ASSERT_TRUE(bundle) << bundle.error().text();
    ASSERT_EQ(bundle->views.size(), 2u);
    EXPECT_NEAR(bundle->views[0].depth.at(3, 3), 1.001, 1e-4);
    EXPECT_NEAR(bundle->views[1].depth.at(3, 3), 1.002, 1e-4);
}

TEST(EveryMoment, CountsFromTheFirstPictureThatIsThere) {
    TemporaryFolder folder;
    const auto set = writeSix(folder, {0});
    const auto sequence = opened(set, everyNth(2));
    ASSERT_TRUE(sequence);
    ASSERT_EQ(sequence->timeline().count(), 3u);
    EXPECT_NEAR(sequence->timeline().start(), 0.1, 1e-9);
    EXPECT_NEAR(depthOf(*sequence, 1, 0), 1.003, 1e-4);
}

// No moment that was left had a picture, and looking for the first went past the last.
TEST(EveryMoment, AfterManyMissingPicturesIsTheOneThatIsThere) {
    for (const int every : {1, 3, 4}) {
        TemporaryFolder folder;
        const auto sequence = opened(writeSix(folder, {0, 1, 2, 3, 4}), everyNth(every));
        ASSERT_TRUE(sequence);
        EXPECT_EQ(sequence->timeline().count(), 1u);
        EXPECT_NEAR(depthOf(*sequence, 0, 0), 1.005, 1e-4);
        Job job;
        const auto bundle = sequence->frame(0, job);
        ASSERT_TRUE(bundle) << bundle.error().text();
        EXPECT_EQ(bundle->views.size(), 1u);
    }
}
