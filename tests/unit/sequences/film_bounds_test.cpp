// Where the points of a film of numbered files are: in all of its frames.

#include "formats/any/info.hpp"
#include "formats/any/save.hpp"
#include "formats/any/sequences.hpp"
#include "tests/shared_data.hpp"
#include "tests/unit/sequences/moving_views.hpp"

using namespace stx;

TEST(FilmBounds, NumberedFilesHaveThoseOfAllFrames) {
    TemporaryFolder folder("bounds");
    Job job;
    MovingViews frames(4);
    const auto film = folder / "f_%02d.exr";
    ASSERT_TRUE(saveSequence(frames, film, {}, job));
    Bounds all;
    for (std::size_t i = 0; i < 4; ++i) {
        const auto bounds = frames.frame(i, job)->computeBounds();
        all.add(bounds.min);
        all.add(bounds.max);
    }
    const auto read = openSequence(film, {}, job);
    ASSERT_TRUE(read) << read.error().text();
    for (const std::size_t i : {0u, 3u}) {
        const auto frame = (*read)->frame(i, job);
        ASSERT_TRUE(frame) << frame.error().text();
        ASSERT_TRUE(frame->bounds);
        EXPECT_LT(glm::distance(frame->bounds->min, all.min), 1e-9) << i;
        EXPECT_LT(glm::distance(frame->bounds->max, all.max), 1e-9) << i;
        const auto table = (*read)->views(i, job);
        ASSERT_TRUE(table);
        EXPECT_EQ((*table)->about().bounds->max.x, frame->bounds->max.x);
    }
    const auto info = describe(film, {}, job);
    ASSERT_TRUE(info) << info.error().text();
    EXPECT_NEAR((*info)["bounds"]["max"][0].get<double>(), all.max.x, 1e-9);
}
