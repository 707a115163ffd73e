// Films through the public header.

#include "formats/stx/stx.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/sequences/moving_views.hpp"

namespace stx {
namespace {

TEST(PublicFilms, AreSavedOpenedAndReadAtATime) {
    const TemporaryFolder folder;
    Job job;
    MovingViews frames(4);
    const auto saved = save(frames, folder / "film.mp4", {}, job);
    ASSERT_TRUE(saved) << saved.error().text();
    const auto film = openSequence(folder / "film.mp4", {}, job);
    ASSERT_TRUE(film) << film.error().text();
    EXPECT_EQ((*film)->timeline().count(), 4u);
    const auto now = (*film)->frame((*film)->timeline().frameAt(0.09), job);
    ASSERT_TRUE(now) << now.error().text();
    expectSameFrame(*now, *frames.frame(2, job));
    const auto refused = save(**film, folder / "film.exr", {}, job);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::usage);
    SaveOptions jpeg, video;
    jpeg.jpegQuality = 90;
    video.h264 = 20;
    for (const auto& [options, what] : {std::pair{jpeg, "JPEG"}, {video, "video"}}) {
        const auto lossy = save(frames, folder / "f_%d.exr", options, job);
        ASSERT_FALSE(lossy);
        EXPECT_EQ(lossy.error().code, ErrorCode::usage);
        EXPECT_NE(lossy.error().message.find(what), std::string::npos) << lossy.error().message;
    }
    EXPECT_FALSE(std::filesystem::exists(folder / "f_0.exr"));
}

TEST(PublicFilms, AreNotReplacedWhileTheyAreRead) {
    const TemporaryFolder folder;
    const auto pattern = folder / "q_%d.exr";
    const auto file = [&](int i) { return folder / fmt::format("q_{}.exr", i); };
    Job job;
    MovingViews frames(3);
    ASSERT_TRUE(save(frames, pattern, {}, job));
    for (const int i : {2, 1, 0}) std::filesystem::rename(file(i), file(i + 1));
    auto film = openSequence(pattern, {}, job);
    ASSERT_TRUE(film) << film.error().text();
    const auto refused = save(**film, pattern, {}, job);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::usage);
    EXPECT_EQ(refused.error().text(),
              fmt::format("'{}' is a file of a film that is open, which would be lost; give the "
                          "output another name",
                          file(1).string()));
    EXPECT_FALSE(std::filesystem::exists(file(0)));
    for (const std::size_t i : {0U, 1U, 2U})
        expectSameFrame(*(*film)->frame(i, job), *frames.frame(i, job));
    film->reset();
    EXPECT_TRUE(save(frames, pattern, {}, job));
}

TEST(PublicFilms, AreThereWithAllFramesOrNotAtAll) {
    const TemporaryFolder folder;
    Job job;
    const auto broken = changed(std::make_unique<MovingViews>(3), [](Bundle& frame, Job&) {
        if (*frame.time > 0.05) frame.views[0].depth.at(0, 0) = -1;
        return Result<void>();
    });
    for (const char* name : {"f_%d.exr", "f.mp4"}) {
        const auto saved = save(*broken, folder / name, {}, job);
        ASSERT_FALSE(saved);
        EXPECT_EQ(saved.error().code, ErrorCode::invalidInput);
        EXPECT_EQ(saved.error().text().find("frame 2 (0.08 s): "), 0U) << saved.error().text();
        EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << name;
    }
}

TEST(PublicFilms, AreNotWrittenUnderNamesThatCannotBeOpened) {
    const TemporaryFolder folder;
    Job job;
    MovingViews frames(2);
    const auto refused = save(frames, folder / "a_%d_%d.exr", {}, job);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::usage);
    EXPECT_NE(refused.error().message.find("has several numbers"), std::string::npos);
    EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace
}  // namespace stx
