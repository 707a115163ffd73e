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
