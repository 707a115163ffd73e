// What films lose in MPEG-4 is said, whichever frame it is of.

#include <array>

#include "formats/any/sequences.hpp"
#include "tests/painted_environment.hpp"
#include "tests/shared_data.hpp"
#include "tests/unit/sequences/moving_views.hpp"

using namespace stx;

namespace {

/// Frames of one view, each made by `change` of its number from one that loses nothing.
class ChangedViews : public Sequence {
  public:
    explicit ChangedViews(std::function<void(ReferenceView&, std::size_t)> change, int count = 3)
        : change_(std::move(change)) {
        timeline_ = steadyTimeline(count, 25);
    }
    Result<Bundle> frame(std::size_t index, Job&) override {
        Bundle bundle;
        bundle.views = {mpeg4::makeView(24, 16, 16, 1)};
        ReferenceView& view = bundle.views[0];
        view.texture = Texture(Rgba8Image(24, 16, {10, 200, 30, 255}));
        const DepthCode code = view.depthCode();
        for (std::size_t i = 0; i < view.depth.count(); ++i)
            view.depth.data()[i] =
                static_cast<float>(code.decode(100 * static_cast<std::uint32_t>(i) + 100));
        change_(view, index);
        setTime(bundle, index);
        return bundle;
    }

  private:
    std::function<void(ReferenceView&, std::size_t)> change_;
};

/// The notes of writing a film as `name`, or the error.
std::vector<std::string> notesOf(std::function<void(ReferenceView&, std::size_t)> change,
                                 const SaveOptions& options = {}, const char* name = "a.mp4") {
    TemporaryFolder folder("losses");
    Job job;
    ChangedViews frames(std::move(change));
    const auto saved = saveSequence(frames, folder / name, options, job);
    if (!saved) return {"error: " + saved.error().text()};
    return job.takeNotes();
}
bool anyHas(const std::vector<std::string>& notes, const std::string& text) {
    return std::ranges::any_of(
        notes, [&](const std::string& note) { return note.find(text) != std::string::npos; });
}

}  // namespace

TEST(FilmLosses, AFilmThatLosesNothingHasNoNote) {
    EXPECT_EQ(notesOf([](ReferenceView& view, std::size_t i) {
                  if (i == 1) std::swap(view.depth.at(3, 3), view.depth.at(4, 4));
              }),
              std::vector<std::string>{});
}

TEST(FilmLosses, AProjectionThatChangesIsRefused) {
    for (const char* name : {"a.mp4", "a.xmt"}) {
        const auto notes =
            notesOf([](ReferenceView& view, std::size_t i) { view.camera.orthographic = i == 1; },
                    {}, name);
        ASSERT_EQ(notes.size(), 1u) << name;
        EXPECT_TRUE(anyHas(notes, "error: ") && anyHas(notes, "frame 1") &&
                    anyHas(notes,
                           "the camera is orthographic and was perspective before; in "
                           "MPEG-4 a view keeps one projection for a whole film; write "
                           ".exr"))
            << notes[0];
    }
}

TEST(FilmLosses, WhatMissingDepthIsInSomeFramesIsNoted) {
    const auto change = [](ReferenceView& view, std::size_t i) {
        view.depth.at(3, 3) = kNoDepth;
        if (i != 1) (*view.texture.rgba8()).at(3, 3).a = 0;
        view.noDepth = i == 1 ? NoDepth::unknown : NoDepth::empty;
    };
    EXPECT_TRUE(anyHas(notesOf(change),
                       "missing depth is empty in some frames and unknown in others; in MPEG-4 it "
                       "is unknown in all"));
}

TEST(FilmLosses, AlphaOfALaterFrameIsNoted) {
    const auto change = [](ReferenceView& view, std::size_t i) {
        if (i == 1) view.texture.rgba8()->at(5, 5).a = 128;
    };
    EXPECT_FALSE(anyHas(notesOf(change), "alpha"));
    SaveOptions jpeg;
    jpeg.jpegQuality = 90;
    EXPECT_TRUE(anyHas(notesOf(change, jpeg), "JPEG has no alpha: soft edges"));
    SaveOptions video;
    video.h264 = 20;
    EXPECT_TRUE(anyHas(notesOf(change, video), "H.264 has no alpha: soft edges"));
    // A still picture stays a PNG, with its alpha.
    EXPECT_FALSE(anyHas(notesOf(
                            [](ReferenceView& view, std::size_t i) {
                                view.texture.rgba8()->at(5, 5).a = 128;
                                if (i == 1) std::swap(view.depth.at(3, 3), view.depth.at(4, 4));
                            },
                            video),
                        "alpha"));
}

TEST(FilmLosses, LinearColourOfALaterFrameIsNoted) {
    for (const float peak : {1.0f, 10.0f}) {
        const auto change = [&](ReferenceView& view, std::size_t i) {
            if (i == 1) view.texture = Texture(RgbaFloatImage(24, 16, {peak, 0.5f, 0.5f, 1.0f}));
        };
        for (const int h264 : {-1, 20}) {
            SaveOptions options;
            options.h264 = h264;
            const auto notes = notesOf(change, options);
            EXPECT_TRUE(anyHas(notes, "linear colour becomes 8-bit sRGB")) << h264;
            EXPECT_EQ(anyHas(notes, "values above 1 are clipped"), peak > 1) << h264;
        }
    }
}

TEST(FilmLosses, DepthThatTheFilmsRangeRoundsIsNoted) {
    const auto change = [](ReferenceView& view, std::size_t i) {
        view.nearPlane = 1;
        view.farPlane = i == 1 ? 10000 : 2;
        const DepthCode code = view.depthCode();
        for (std::size_t k = 0; k < view.depth.count(); ++k)
            view.depth.data()[k] =
                static_cast<float>(code.decode(100 * static_cast<std::uint32_t>(k) + 100));
    };
    const auto notes = notesOf(change);
    ASSERT_EQ(notes.size(), 1u);
    double off = 0;
    ASSERT_EQ(
        std::sscanf(notes[0].c_str(), "depth is rounded to 16 bits: at most %lf scene units", &off),
        1)
        << notes[0];
    // Half of a step of the film.
    EXPECT_LE(off, 0.5 * 9999 / 65534 * 1.001);
    EXPECT_GE(off, 0.9 * 0.5 * 9999 / 65534);
}

TEST(FilmLosses, DepthBeyondThePlanesIsClampedAndNotRounded) {
    // Of a single frame, of pictures of a film, and of its video.
    struct Way {
        int count;
        int h264;
        bool points;
    };
    for (const Way way :
         {Way{1, -1, false}, Way{1, -1, true}, Way{3, -1, false}, Way{3, 20, false}}) {
        ChangedViews frames(
            [&](ReferenceView& view, std::size_t i) {
                if (i + 1 == static_cast<std::size_t>(way.count))
                    view.depth.at(3, 3) = static_cast<float>(view.farPlane + 40);
            },
            way.count);
        TemporaryFolder folder("beyond_planes");
        SaveOptions options;
        options.h264 = way.h264;
        options.pointTexture = way.points;
        Job job;
        const auto saved = saveSequence(frames, folder / "a.mp4", options, job);
        if (!saved && saved.error().code == ErrorCode::unsupported) continue;  // no video here
        ASSERT_TRUE(saved) << saved.error().text();
        const auto notes = job.takeNotes();
        EXPECT_TRUE(anyHas(notes,
                           "depth beyond nearPlane or farPlane was clamped to them: at most 40 "
                           "scene units off"))
            << fmt::format("{}", fmt::join(notes, "\n"));
        EXPECT_FALSE(anyHas(notes, "depth is rounded"));
    }
}

TEST(FilmLosses, AFrameWithoutAPointHasNoPartInTheDepthRange) {
    for (const std::size_t empty : {0u, 1u, 3u}) {
        TemporaryFolder folder("empty_frames");
        Job job;
        const auto change = [&](ReferenceView& view, std::size_t i) {
            if (i != empty && empty != 3) return;
            view.depth = Image<float>(24, 16, kNoDepth);
            view.texture = Texture(Rgba8Image(24, 16, {0, 0, 0, 0}));
            view.nearPlane = ViewHeader().nearPlane;
            view.farPlane = ViewHeader().farPlane;
        };
        ChangedViews frames(change);
        ASSERT_TRUE(saveSequence(frames, folder / "a.mp4", {}, job));
        std::vector<std::string> expected;
        if (empty == 3) expected.emplace_back("view 'view1': no frame of it has a point");
        EXPECT_EQ(job.takeNotes(), expected);
        const auto read = openSequence(folder / "a.mp4", {}, job);
        ASSERT_TRUE(read) << read.error().text();
        const auto last = (*read)->frame((*read)->timeline().count() - 1, job);
        ASSERT_TRUE(last) << last.error().text();
        const auto was = frames.frame(2, job);
        EXPECT_EQ(last->views[0].nearPlane, was->views[0].nearPlane) << empty;
        EXPECT_EQ(last->views[0].farPlane, was->views[0].farPlane) << empty;
        EXPECT_EQ(last->views[0].depth, was->views[0].depth) << empty;
    }
}

TEST(FilmLosses, PlanesThatAnEmptyViewHasMayBeThoseOfPoints) {
    TemporaryFolder folder("default_planes");
    Job job;
    ChangedViews frames([](ReferenceView& view, std::size_t i) {
        if (i != 1) return;
        view.nearPlane = ViewHeader().nearPlane;
        view.farPlane = ViewHeader().farPlane;
        view.depth = Image<float>(24, 16, 90.0f);
    });
    ASSERT_TRUE(saveSequence(frames, folder / "a.mp4", {}, job));
    const auto read = openSequence(folder / "a.mp4", {}, job);
    ASSERT_TRUE(read) << read.error().text();
    const auto frame = (*read)->frame(1, job);
    ASSERT_TRUE(frame) << frame.error().text();
    EXPECT_NEAR(frame->views[0].depth.at(0, 0), 90, 0.002);
}

TEST(FilmLosses, WhatIsPrunedInALaterFrameStaysSo) {
    TemporaryFolder folder("pruned");
    Job job;
    const auto change = [](ReferenceView& view, std::size_t i) {
        if (i == 1) view.depth.at(3, 3) = kNoDepth;  // with full alpha
        view.pruned = i == 1;
    };
    ChangedViews frames(change);
    ASSERT_TRUE(saveSequence(frames, folder / "a.mp4", {}, job));
    EXPECT_EQ(job.takeNotes(),
              std::vector<std::string>{"view 'view1': it is pruned in some frames and not in "
                                       "others; in MPEG-4 it is in all"});
    const auto read = openSequence(folder / "a.mp4", {}, job);
    ASSERT_TRUE(read) << read.error().text();
    const auto frame = (*read)->frame(1, job);
    ASSERT_TRUE(frame) << frame.error().text();
    EXPECT_TRUE(frame->views[0].pruned);
    EXPECT_EQ(frame->views[0].texture.rgba8()->at(3, 3).a, 255);
}

TEST(FilmLosses, AnEnvironmentThatChangesIsNoted) {
    TemporaryFolder folder("environments");
    for (const bool differs : {false, true}) {
        auto frames =
            changed(std::make_unique<MovingViews>(4), [&](Bundle& frame, Job&) -> Result<void> {
                // Each frame of files has one of its own.
                const bool other = differs && *frame.time > 0.05;
                frame.environment = std::make_shared<Environment>(paintedCube(other ? 4 : 2));
                return {};
            });
        Job job;
        ASSERT_TRUE(saveSequence(*frames, folder / "a.mp4", {}, job));
        const auto notes = job.takeNotes();
        EXPECT_EQ(std::ranges::count(notes,
                                     "the environment of frame 2 (0.08 s) is not that of the first "
                                     "frame, which the film keeps; write .exr for one in each "
                                     "frame"),
                  differs ? 1 : 0);
    }
}
