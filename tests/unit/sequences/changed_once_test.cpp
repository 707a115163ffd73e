// What takes long is done once to each frame of a film, though the film is written in two passes.

#include "formats/any/changed_once.hpp"

#include <filesystem>

#include "formats/any/sequences.hpp"
#include "lib/model/same_pictures.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/sequences/moving_views.hpp"

namespace stx {
namespace {

constexpr int kFrames = 5;

/// Changes what refining changes: images, headers and bounds.
class Counted {
  public:
    int changes = 0;

    auto change() {
        return [this](Bundle& bundle, Job& job) -> Result<void> {
            ++changes;
            ReferenceView& view = bundle.views[0];
            view.depth.at(3, 3) = static_cast<float>(view.depthCode().decode(500));
            auto colours = *view.texture.rgba8();
            colours.at(3, 3) = glm::u8vec4(1, 2, 3, 255);
            view.texture = Texture(colours);
            if (view.hasNormals()) view.normal.at(3, 3) = {0, 1, 0};
            if (view.hasSplats()) view.splatU.at(3, 3) = view.splatV.at(3, 3) = {0.5f, 0, 0};
            if (view.hasMaterial()) view.metallicRoughness.at(3, 3) = {0, 1};
            view.refined = {"noise", 0.01f};
            bundle.bounds = bundle.computeBounds();
            job.note("changed");
            return {};
        };
    }
};

std::size_t filesIn(const std::filesystem::path& folder) {
    return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder), {}));
}

TEST(ChangedOnce, AFilmIsChangedOnceThoughItIsWrittenInTwoPasses) {
    const TemporaryFolder folder;
    Job job;
    auto moving = std::make_unique<MovingViews>(kFrames);
    MovingViews& asked = *moving;
    Counted once;
    const auto frames = changedOnce(std::move(moving), once.change(), folder.path());
    ASSERT_TRUE(saveSequence(*frames, folder / "film.mp4", {}, job));
    EXPECT_EQ(once.changes, kFrames);
    EXPECT_GE(asked.asked, 2 * kFrames);
    const auto written = openSequence(folder / "film.mp4", {}, job);
    ASSERT_TRUE(written) << written.error().text();
    MovingViews again(kFrames);
    for (std::size_t i = 0; i < kFrames; ++i) {
        Bundle expected = *again.frame(i, job);
        ASSERT_TRUE(once.change()(expected, job));
        const auto frame = (*written)->frame(i, job);
        ASSERT_TRUE(frame) << frame.error().text();
        expectSameFrame(*frame, expected);
        EXPECT_EQ(frame->views[0].refined.steps, "noise");
    }
}

/// With all images that a view can have.
std::unique_ptr<Sequence> fullViews() {
    return changed(std::make_unique<MovingViews>(kFrames), [](Bundle& bundle, Job&) {
        for (ReferenceView& view : bundle.views) {
            mpeg4::addVectors(view);
            view.metallicRoughness = Image<glm::vec2>(24, 16, glm::vec2(0.5f));
        }
        return Result<void>();
    });
}

TEST(ChangedOnce, AsksForFramesInAnyOrderAndGivesThemTheSame) {
    const TemporaryFolder folder;
    Counted once, plain;
    const auto kept = changedOnce(fullViews(), once.change(), folder.path());
    const auto each = changed(fullViews(), plain.change());
    for (const std::size_t i : {2, 0, 2, 4, 0, 2}) {
        Job a, b;
        const auto is = kept->frame(i, a), expected = each->frame(i, b);
        ASSERT_TRUE(is && expected);
        for (std::size_t v = 0; v < expected->views.size(); ++v) {
            EXPECT_TRUE(samePictures(is->views[v], expected->views[v]));
            EXPECT_TRUE(is->views[v].hasSplats() && is->views[v].hasMaterial());
        }
        EXPECT_EQ(is->bounds->min, expected->bounds->min);
        EXPECT_EQ(a.takeNotes(), b.takeNotes());
    }
    EXPECT_EQ(once.changes, 3);
    EXPECT_EQ(plain.changes, 6);
}

TEST(ChangedOnce, LeavesNothingBehindAndNeedsNoFileWhereNothingChanges) {
    const TemporaryFolder folder;
    Job job;
    {
        Counted once;
        const auto frames =
            changedOnce(std::make_unique<MovingViews>(kFrames), once.change(), folder.path());
        ASSERT_TRUE(frames->frame(0, job));
        EXPECT_EQ(filesIn(folder.path()), 1u);
    }
    EXPECT_EQ(filesIn(folder.path()), 0u);
    const auto same = changedOnce(
        std::make_unique<MovingViews>(kFrames), [](Bundle&, Job&) -> Result<void> { return {}; },
        folder / "missing");
    EXPECT_TRUE(same->frame(0, job));
    EXPECT_TRUE(same->frame(0, job));
    Counted once;
    const auto nowhere =
        changedOnce(std::make_unique<MovingViews>(kFrames), once.change(), folder / "missing");
    const auto failed = nowhere->frame(0, job);
    ASSERT_FALSE(failed);
    EXPECT_EQ(failed.error().code, ErrorCode::io);
}

}  // namespace
}  // namespace stx
