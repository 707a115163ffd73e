// Pictures of a film in which nothing is to be seen for a while.

#include <limits>

#include "formats/any/sequences.hpp"
#include "formats/imagesets/export.hpp"
#include "tests/unit/sequences/shots.hpp"

using namespace stx;
using namespace sets;
using namespace shots;

namespace {

/// Two cameras at 0, 1 and 2 s. Picture i of the file is of camera b where i is odd.
std::filesystem::path writeTwoCameras(const TemporaryFolder& folder) {
    return writeShots(folder, {{"a", 0, 0, 1},
                               {"b", 0, 1, 2},
                               {"a", 1, 0, 3},
                               {"b", 1, 1, 4},
                               {"a", 2, 0, 5},
                               {"b", 2, 1, 6}});
}

/// Gives a picture of writeShots() float depth of one value.
void setDepth(const TemporaryFolder& folder, int picture, float value) {
    const auto json = folder / "transforms.json";
    const auto bytes = readFile(json, {});
    ASSERT_TRUE(bytes);
    std::string text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
    const std::string name = fmt::format("d{}.png", picture);
    text.replace(text.find(name), name.size(), fmt::format("d{}.exr", picture));
    writeText(json, text);
    writeExr(folder / fmt::format("d{}.exr", picture), {{"Z", Image<float>(8, 6, value)}});
}

/// Points of each view in each frame.
using Counts = std::vector<std::vector<std::int64_t>>;

Counts countsOf(Sequence& frames) {
    Counts all;
    for (std::size_t i = 0; i < frames.timeline().count(); ++i) {
        Job job;
        const auto bundle = frames.frame(i, job);
        EXPECT_TRUE(bundle) << bundle.error().text();
        if (!bundle) return all;
        all.emplace_back();
        for (const ReferenceView& view : bundle->views) all.back().push_back(view.pointCount());
    }
    return all;
}

constexpr float kInfinite = std::numeric_limits<float>::infinity();

}  // namespace

TEST(EmptyMoments, InfiniteDepthEverywhereIsNothing) {
    TemporaryFolder folder;
    const auto set = writeTwoCameras(folder);
    setDepth(folder, 3, kInfinite);
    ImageSetOptions strict;
    strict.strict = true;
    for (const ImageSetOptions& options : {ImageSetOptions(), strict}) {
        const auto film = opened(set, options);
        ASSERT_TRUE(film);
        EXPECT_EQ(countsOf(*film), (Counts{{48, 48}, {48, 0}, {48, 48}}));
    }
    Job job;
    ImageSetOptions one;
    one.frame = 1;
    const auto moment = readImageSet(set, one, job);
    ASSERT_TRUE(moment) << moment.error().text();
    EXPECT_EQ(moment->views[1].pointCount(), 0);
    EXPECT_EQ(moment->views[1].texture.at(3, 3).a, 0.0f);
}

TEST(EmptyMoments, ComeBackFromEachContainer) {
    TemporaryFolder folder;
    const auto set = writeTwoCameras(folder);
    setDepth(folder, 3, kInfinite);
    for (const char* target : {"film.mp4", "film_%02d.exr", "out"}) {
        SCOPED_TRACE(target);
        const auto film = opened(set);
        ASSERT_TRUE(film);
        Job job;
        const auto path = folder / target;
        const auto written = std::string(target) == "out" ? exportFrames(*film, path, {}, job)
                                                          : saveSequence(*film, path, {}, job);
        ASSERT_TRUE(written) << written.error().text();
        const auto read = openSequence(path, {}, job);
        ASSERT_TRUE(read) << read.error().text();
        EXPECT_EQ(countsOf(**read), (Counts{{48, 48}, {48, 0}, {48, 48}}));
        // An export of what was read, too.
        const auto again = folder / (std::string("again_") + target);
        ASSERT_TRUE(exportFrames(**read, again, {}, job));
        const auto back = opened(again / "transforms.json");
        ASSERT_TRUE(back);
        EXPECT_EQ(countsOf(*back), (Counts{{48, 48}, {48, 0}, {48, 48}}));
    }
}

TEST(EmptyMoments, BlackMasksShowNothing) {
    TemporaryFolder folder;
    const auto set = writeTwoCameras(folder);
    for (int i = 0; i < 6; ++i)
        writeCodes(folder / fmt::format("m_c{}.png", i), 8, 6, 8,
                   [&](int, int) { return i == 3 ? 0 : 255; });
    ImageSetOptions options;
    options.maskPattern = folder / "m_{stem}.png";
    const auto film = opened(set, options);
    ASSERT_TRUE(film);
    EXPECT_EQ(countsOf(*film), (Counts{{48, 48}, {48, 0}, {48, 48}}));
}

// A sensor that lost a frame says that depth is not known: the picture before is shown on.
TEST(EmptyMoments, UnknownDepthEverywhereIsDamage) {
    TemporaryFolder folder;
    const auto set = writeTwoCameras(folder);
    setDepth(folder, 3, 0.0f);
    const auto film = opened(set);
    ASSERT_TRUE(film);
    EXPECT_EQ(countsOf(*film), (Counts{{48, 48}, {48, 48}, {48, 48}}));
    EXPECT_NEAR(depthOf(*film, 1, 1), 1.002, 1e-4);
    ImageSetOptions options;
    options.strict = true;
    const auto strict = opened(set, options);
    ASSERT_TRUE(strict);
    Job job;
    EXPECT_FALSE(strict->frame(1, job));
}

TEST(EmptyMoments, OfAStillSetAreLeftOut) {
    TemporaryFolder folder;
    const auto set = writeTwoCameras(folder);
    setDepth(folder, 3, kInfinite);
    ImageSetOptions options;
    options.moving = false;
    Job job;
    const auto still = readImageSet(set, options, job);
    ASSERT_TRUE(still) << still.error().text();
    EXPECT_EQ(still->views.size(), 5u);
}

TEST(EmptyMoments, AViewWithoutAPointInAnyFrameIsNoted) {
    TemporaryFolder folder;
    const auto set = writeTwoCameras(folder);
    for (const int picture : {1, 3, 5}) setDepth(folder, picture, kInfinite);
    const auto film = opened(set);
    ASSERT_TRUE(film);
    Job job;
    const auto saved = saveSequence(*film, folder / "film.mp4", {}, job);
    ASSERT_TRUE(saved) << saved.error().text();
    const auto notes = job.takeNotes();
    EXPECT_TRUE(std::ranges::find(notes, "view 'b': no frame of it has a point") != notes.end())
        << fmt::format("{}", fmt::join(notes, "\n"));
}
