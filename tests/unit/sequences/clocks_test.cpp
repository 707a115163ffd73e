// A film keeps its clock in every container: where it begins, when its frames are shown, when it
// ends.

#include <cmath>

#include "formats/any/sequences.hpp"
#include "formats/atlas/atlas_files.hpp"
#include "formats/imagesets/export.hpp"
#include "lib/packing/packing.hpp"
#include "tests/ffmpeg.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/sequences/moving_views.hpp"

using namespace stx;

namespace {

constexpr int kClockFrames = 12;

/// A film through one container.
std::unique_ptr<Sequence> through(const std::string& target, Sequence& frames,
                                  const TemporaryFolder& folder) {
    Job job;
    std::filesystem::path path = folder / target;
    SaveOptions save;
    Result<void> done;
    if (target == "set") {
        ExportOptions options;
        options.depth = ExportOptions::Depth::exr;
        done = exportFrames(frames, path, options, job);
    } else if (target == "atlas_%02d") {
        for (std::size_t i = 0; done && i < frames.timeline().count(); ++i) {
            const auto atlas = pack(*frames.frame(i, job), {}, job);
            EXPECT_TRUE(atlas) << atlas.error().text();
            done = writeAtlas(*atlas, folder / fmt::format("atlas_{:02}", i), job, {});
        }
    } else {
        if (target == "h264.mp4") save.h264 = 20;
        done = saveSequence(frames, path, save, job);
    }
    EXPECT_TRUE(done) << target << ": " << done.error().text();
    auto opened = openSequence(path, {}, job);
    EXPECT_TRUE(opened) << target << ": " << opened.error().text();
    return opened ? std::move(*opened) : nullptr;
}

std::vector<std::string> containers() {
    std::vector<std::string> all = {"film.mp4",      "film.bt", "film.xmt",
                                    "film_%02d.exr", "set",     "atlas_%02d"};
    if (VideoProcess::start(Limits())) all.emplace_back("h264.mp4");
    return all;
}

/// The frames that are shown at `times` + `by`.
std::vector<std::size_t> shownAt(const Timeline& line, const std::vector<double>& times,
                                 double by = 0) {
    std::vector<std::size_t> shown;
    for (const double time : times) shown.push_back(line.frameAt(time + by));
    return shown;
}

}  // namespace

TEST(Clocks, TheTimesOfFramesShowEachFrameOnce) {
    std::vector<std::size_t> each;
    for (std::size_t i = 0; i < kClockFrames; ++i) each.push_back(i);
    for (const double rate :
         {24000.0 / 1001, 24.0, 25.0, 29.5, 30000.0 / 1001, 30.0, 39.0, 60000.0 / 1001, 120.0})
        for (const std::string& target : containers()) {
            // Its ticks are those of other .mp4; encoding takes long.
            if (target == "h264.mp4" && rate != 39) continue;
            TemporaryFolder folder;
            MovingViews frames(kClockFrames, rate, false);
            const auto read = through(target, frames, folder);
            ASSERT_TRUE(read);
            std::vector<double> times;
            for (int i = 0; i < kClockFrames; ++i) times.push_back(i / rate);
            EXPECT_EQ(shownAt(read->timeline(), times), each) << target << " at " << rate;
            EXPECT_EQ(read->timeline().count(), each.size()) << target << " at " << rate;
            EXPECT_NEAR(read->timeline().rate(), rate, 1e-4) << target;
        }
}

TEST(Clocks, KeepWhereTheyBeginAndEnd) {
    Timeline line;
    line.times = {0, 0.1, 0.133, 0.2, 0.39};
    line.end = 1.5;
    line.findTick();
    const std::vector<double> asked = {-0.5, 0, 0.0999, 0.1, 0.15, 0.2, 0.389, 0.39, 1, 3};
    const std::vector<std::size_t> expected = {0, 0, 1, 1, 2, 3, 3, 4, 4, 4};
    EXPECT_EQ(shownAt(line, asked), expected)
        << "the ticks are milliseconds, and half of one is slack";
    for (const double by : {0.0, 7.3, -1.0, 1.3e9})
        for (const std::string& target : containers()) {
            if (target == "h264.mp4" && by != 1.3e9) continue;
            TemporaryFolder folder;
            MovingViews frames(moved(line, by), false);
            const auto read = through(target, frames, folder);
            ASSERT_TRUE(read);
            const Timeline& is = read->timeline();
            EXPECT_EQ(is.start(), by) << target;
            // Doubles of 1.3e9 are 2.4e-7 apart.
            EXPECT_NEAR(is.end - by, line.end, 1e-6) << target << " from " << by;
            EXPECT_EQ(shownAt(is, asked, by), expected) << target << " from " << by;
            EXPECT_TRUE(is.outside(by - 0.01));
            EXPECT_FALSE(is.outside(by + 1.4));
            EXPECT_TRUE(is.outside(by + 1.6)) << target;
            Job job;
            const auto last = read->frame(4, job);
            ASSERT_TRUE(last) << target;
            EXPECT_NEAR(*last->time, by + 0.39, 1e-6);
            EXPECT_NEAR(*last->duration, 1.11, 1e-6);
            if (target != "h264.mp4") expectSameFrame(*last, *frames.frame(4, job));
        }
}

TEST(Clocks, OneMomentKeepsItsTime) {
    Job job;
    TemporaryFolder folder;
    Timeline line;
    line.times = {7.3};
    line.end = 7.4;
    MovingViews frames(line);
    for (const char* name : {"one.mp4", "one.exr"}) {
        ASSERT_TRUE(saveSequence(frames, folder / name, {}, job));
        const auto read = openSequence(folder / name, {}, job);
        ASSERT_TRUE(read);
        EXPECT_DOUBLE_EQ((*read)->frame(0, job)->time.value_or(0), 7.3) << name;
    }
}

TEST(Clocks, ShortFramesHaveLessSlack) {
    Timeline line;
    line.times = {0, 1, 1.001, 1.002};
    line.end = 1.003;
    line.findTick();
    EXPECT_EQ(shownAt(line, {0.9995, 0.99995, 1.0005, 1.0008, 1.00095, 1.002}),
              (std::vector<std::size_t>{0, 1, 1, 1, 2, 3}))
        << "a tenth of a millisecond";
    line.times = {0, 0.008, 0.017, 0.025};  // 120 frames a second, in milliseconds
    line.end = 0.033;
    line.findTick();
    EXPECT_EQ(shownAt(line, {1 / 120.0, 2 / 120.0, 3 / 120.0}),
              (std::vector<std::size_t>{1, 2, 3}));
}

TEST(Clocks, CoarserTicksHaveMoreSlackUpToHalfAMillisecond) {
    EXPECT_NEAR(halfTick(1e-6, 0), 5e-7, 1e-12);
    EXPECT_NEAR(halfTick(0.04, 0), 0.0005, 1e-9);
    EXPECT_GT(halfTick(1e-9, 1.3e9), 2.4e-7) << "as far as doubles are apart there";
}
