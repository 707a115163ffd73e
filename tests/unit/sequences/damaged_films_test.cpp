// Films of which frames are missing or damaged go on with the frames before, and say so.

#include <set>

#include "formats/any/save.hpp"
#include "formats/any/sequences.hpp"
#include "formats/files/files.hpp"
#include "formats/mpeg4/mpeg4.hpp"
#include "formats/video/video_process.hpp"
#include "tests/shared_data.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/sequences/moving_views.hpp"

using namespace stx;

namespace {

/// Frames, some of which cannot be read.
class DamagedViews : public MovingViews {
  public:
    DamagedViews(int count, std::set<std::size_t> bad, ErrorCode code = ErrorCode::invalidInput)
        : MovingViews(count), bad_(std::move(bad)), code_(code) {}
    Result<Bundle> frame(std::size_t index, Job& job) override {
        job.note(fmt::format("frame {} was tried", index));
        if (bad_.contains(index)) return fail(code_, "frame {} is bad", index);
        return MovingViews::frame(index, job);
    }

  private:
    std::set<std::size_t> bad_;
    ErrorCode code_;
};

/// Views that are read when they are asked for; the last of a bad frame cannot be.
class ReadOnDemand : public ViewTable {
  public:
    ReadOnDemand(Bundle bundle, bool bad)
        : ViewTable(headersOf(bundle), tableOf(bundle)->kinds()),
          bundle_(std::move(bundle)),
          bad_(bad) {}

  protected:
    Result<std::shared_ptr<const ReferenceView>> make(std::size_t index, Job& job) const override {
        job.note("a view was read");
        if (bad_ && index + 1 == count()) return fail(ErrorCode::invalidInput, "a view is bad");
        return std::make_shared<ReferenceView>(bundle_.views[index]);
    }

  private:
    Bundle bundle_;
    bool bad_;
};
class DamagedOnDemand : public MovingViews {
  public:
    DamagedOnDemand(int count, std::set<std::size_t> bad)
        : MovingViews(count), bad_(std::move(bad)) {}
    Result<std::unique_ptr<ViewTable>> views(std::size_t index, Job& job) override {
        STX_TRY(auto bundle, frame(index, job));
        return std::make_unique<ReadOnDemand>(std::move(bundle), bad_.contains(index));
    }

  private:
    std::set<std::size_t> bad_;
};

/// The frame of MovingViews that is shown at each index; -1 where there is an error.
std::vector<int> shown(Sequence& frames) {
    std::vector<int> numbers;
    for (std::size_t i = 0; i < frames.timeline().count(); ++i) {
        Job job;
        const auto bundle = frames.frame(i, job);
        if (bundle) {
            EXPECT_EQ(bundle->time, frames.timeline().times[i]);
        }
        numbers.push_back(bundle ? (bundle->views[0].texture.rgba8()->at(1, 0).r - 10) / 20 : -1);
    }
    return numbers;
}

std::string takenNotes(Job& job) {
    std::string all;
    for (const std::string& note : job.takeNotes()) all += note + "\n";
    return all;
}

std::unique_ptr<Sequence> opened(const std::filesystem::path& path, Job& job, bool strict = false) {
    OpenOptions options;
    options.set.strict = strict;
    auto frames = openSequence(path, options, job);
    EXPECT_TRUE(frames) << frames.error().text();
    return frames ? std::move(*frames) : nullptr;
}

void damage(const std::filesystem::path& path, std::uint64_t from, std::uint64_t count) {
    auto bytes = *readFile(path, {});
    for (std::uint64_t i = from; i < from + count && i < bytes.size(); ++i)
        bytes[i] ^= std::byte{0x5a};
    ASSERT_TRUE(writeFile(path, bytes));
}

/// Damages a sample of the first stream that moves: the colours of MovingViews' first view.
void damageSample(const std::filesystem::path& path, std::size_t sample) {
    Job job;
    std::uint64_t from = 0, size = 0;
    {
        const auto document = readMpeg4(path, job);
        ASSERT_TRUE(document);
        for (const auto* od : document->objectDescriptors())
            if (const auto& stream = od->streams.at(0); stream.samples.size() > sample && !size) {
                from = stream.samples[sample].data.offset;
                size = stream.samples[sample].data.size;
            }
    }
    ASSERT_GT(size, 20u);
    damage(path, from + size / 2, size / 4);
}

}  // namespace

TEST(DamagedFilms, ShowTheFrameBefore) {
    const auto film =
        acrossDamage(std::make_unique<DamagedViews>(8, std::set<std::size_t>{3, 4, 7}));
    EXPECT_EQ(shown(*film), (std::vector<int>{0, 1, 2, 2, 2, 5, 6, 6}));
}

TEST(DamagedFilms, BeginWithTheFirstThatCanBeRead) {
    const auto film =
        acrossDamage(std::make_unique<DamagedViews>(5, std::set<std::size_t>{0, 1, 3}));
    EXPECT_EQ(shown(*film), (std::vector<int>{2, 2, 2, 2, 4}));
}

TEST(DamagedFilms, SayItOnceAndToTheJobAbove) {
    const auto film = acrossDamage(std::make_unique<DamagedViews>(4, std::set<std::size_t>{1, 3}));
    Job job, part;
    part.workFor(job);
    for (std::size_t i = 0; i < 4; ++i) ASSERT_TRUE(film->frame(i, part));
    EXPECT_EQ(takenNotes(job),
              "frame 1 (0.04 s) cannot be used: the one before it is shown in its place, and no "
              "more is said of others like it; stx convert --strict stops there: frame 1 is bad\n");
    EXPECT_EQ(takenNotes(part).find("frame 1 was tried"), std::string::npos);
}

TEST(DamagedFilms, ViewsOnDemandAreThoseOfTheFrameBefore) {
    constexpr std::uint64_t kRoomForOneView = 10'000;  // a frame takes 6144 bytes
    for (const std::uint64_t limit : {kRoomForOneView, Limits().maxMemoryBytes}) {
        const auto film =
            acrossDamage(std::make_unique<DamagedOnDemand>(4, std::set<std::size_t>{0, 2}));
        Job job;
        job.limits.maxMemoryBytes = limit;
        std::vector<int> numbers;
        for (const std::size_t i : {0u, 1u, 2u, 3u, 2u}) {
            const auto table = film->views(i, job);
            ASSERT_TRUE(table) << table.error().text();
            EXPECT_EQ((*table)->whole(), limit != kRoomForOneView);
            EXPECT_EQ((*table)->about().time, film->timeline().times[i]);
            for (std::size_t k = 0; k < (*table)->count(); ++k) {
                const auto view = (*table)->view(k, job);
                ASSERT_TRUE(view) << view.error().text();
                if (k == 0) numbers.push_back(((*view)->texture.rgba8()->at(1, 0).r - 10) / 20);
            }
        }
        EXPECT_EQ(numbers, (std::vector<int>{1, 1, 1, 3, 1}));
        const auto notes = takenNotes(job);
        EXPECT_NE(notes.find("frame 0 (0 s) cannot be used"), std::string::npos) << notes;
        // What is read to find damage is not said twice.
        EXPECT_EQ(notes.find("a view was read (10 times)") != std::string::npos,
                  limit == kRoomForOneView)
            << notes;
    }
}

TEST(DamagedFilms, OtherErrorsAreErrors) {
    const auto stopped = acrossDamage(
        std::make_unique<DamagedViews>(3, std::set<std::size_t>{1}, ErrorCode::failed));
    EXPECT_EQ(shown(*stopped), (std::vector<int>{0, -1, 2}));
    const auto all = acrossDamage(std::make_unique<DamagedViews>(2, std::set<std::size_t>{0, 1}));
    Job job;
    const auto frame = all->frame(1, job);
    ASSERT_FALSE(frame);
    EXPECT_EQ(frame.error().text(), "frame 1 is bad");
}

TEST(DamagedFilms, NumberedFilesMayBeMissing) {
    TemporaryFolder folder;
    MovingViews frames(moved(steadyTimeline(6, 25), 7.3));
    const auto path = folder / "f_%02d.exr";
    Job job;
    ASSERT_TRUE(saveSequence(frames, path, {}, job));
    std::filesystem::remove(folder / "f_02.exr");
    std::filesystem::remove(folder / "f_04.exr");
    const auto film = opened(path, job);
    ASSERT_TRUE(film);
    EXPECT_EQ(shown(*film), (std::vector<int>{0, 1, 3, 5}));
    EXPECT_EQ(film->timeline().start(), 7.3);
    EXPECT_NEAR(film->timeline().end, 7.54, 1e-6);
    const auto notes = takenNotes(job);
    EXPECT_NE(notes.find("number 2 is missing"), std::string::npos) << notes;
    OpenOptions strict;
    strict.set.strict = true;
    const auto refused = openSequence(path, strict, job);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::io);
}

TEST(DamagedFilms, NumbersMayCountInSteps) {
    TemporaryFolder folder;
    MovingViews frames(9);
    Job job;
    ASSERT_TRUE(saveSequence(frames, folder / "f_%02d.exr", {}, job));
    for (const int i : {0, 1, 3, 4, 6, 7})
        std::filesystem::remove(folder / fmt::format("f_{:02}.exr", i));
    ASSERT_TRUE(opened(folder / "f_%02d.exr", job, true));
    EXPECT_EQ(takenNotes(job).find("missing"), std::string::npos);
}

TEST(DamagedFilms, NumberedFilesMayBeDamaged) {
    TemporaryFolder folder;
    MovingViews frames(6);
    const auto path = folder / "f_%02d.exr";
    Job job;
    ASSERT_TRUE(saveSequence(frames, path, {}, job));
    const auto cut = [&](const char* name, std::size_t size) {
        auto bytes = *readFile(folder / name, {});
        bytes.resize(size);
        ASSERT_TRUE(writeFile(folder / name, bytes));
    };
    cut("f_00.exr", 60);  // its header tells nothing: the film begins later
    cut("f_02.exr", std::filesystem::file_size(folder / "f_02.exr") / 2);
    const auto film = opened(path, job);
    ASSERT_TRUE(film);
    EXPECT_EQ(shown(*film), (std::vector<int>{1, 1, 3, 4, 5}));
    const auto notes = takenNotes(job);
    EXPECT_NE(notes.find("1 of 6 frames cannot be used"), std::string::npos) << notes;
    EXPECT_NE(notes.find("f_00.exr"), std::string::npos) << notes;
    OpenOptions strict;
    strict.set.strict = true;
    EXPECT_FALSE(openSequence(path, strict, job));
}

TEST(DamagedFilms, FilesOfOtherViewsAreNotDamaged) {
    TemporaryFolder folder;
    MovingViews frames(3);
    const auto path = folder / "f_%02d.exr";
    Job job;
    ASSERT_TRUE(saveSequence(frames, path, {}, job));
    auto other = frames.frame(2, job);
    ASSERT_TRUE(other);
    std::swap(other->views[0], other->views[1]);
    ASSERT_TRUE(saveBundle(*other, folder / "f_02.exr", {}, job));
    for (const bool strict : {false, true}) {
        OpenOptions options;
        options.set.strict = strict;
        const auto film = openSequence(path, options, job);
        ASSERT_FALSE(film);
        EXPECT_EQ(film.error().code, ErrorCode::invalidInput);
        EXPECT_NE(film.error().text().find("f_02.exr': view 0 is '"), std::string::npos)
            << film.error().text();
    }
}

TEST(DamagedFilms, SamplesMayBeDamaged) {
    TemporaryFolder folder;
    MovingViews frames(6, 25, false);
    for (const bool video : {false, true}) {
        if (video && !VideoProcess::start(Limits())) continue;
        const auto path = folder / "film.mp4";
        Job job;
        SaveOptions save;
        if (video) save.h264 = 4;
        ASSERT_TRUE(saveSequence(frames, path, save, job));
        damageSample(path, 3);
        const auto film = opened(path, job);
        ASSERT_TRUE(film);
        EXPECT_NEAR(film->timeline().end, 0.24, 1e-6);
        Job reading;
        const auto before = film->frame(2, reading), bad = film->frame(3, reading);
        ASSERT_TRUE(before) << before.error().text();
        ASSERT_TRUE(bad) << bad.error().text();
        EXPECT_EQ(bad->time, film->timeline().times[3]);
        expectSameFrame(*bad, *before);
        EXPECT_NE(takenNotes(reading).find("frame 3 (0.12 s) cannot be used"), std::string::npos);
        if (!video) {
            EXPECT_EQ(shown(*film), (std::vector<int>{0, 1, 2, 2, 4, 5}));
        }
        const auto strict = opened(path, job, true);
        ASSERT_TRUE(strict);
        EXPECT_TRUE(strict->frame(2, reading));
        EXPECT_FALSE(strict->frame(3, reading));
    }
}
