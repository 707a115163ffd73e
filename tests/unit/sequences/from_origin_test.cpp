// Coordinates that floats would round are counted from an origin nearby.
#include "lib/model/from_origin.hpp"

#include "formats/any/sequences.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/sequences/moving_views.hpp"

namespace stx {
namespace {

constexpr glm::dvec3 kFar(5e6, 0, -3e6);

/// The moving views at a distance, with bounds or without.
std::unique_ptr<Sequence> farViews(glm::dvec3 away, bool bounds) {
    return changed(std::make_unique<MovingViews>(3), [away, bounds](Bundle& bundle, Job&) {
        for (ReferenceView& view : bundle.views) view.camera.position += away;
        if (bounds) bundle.bounds = bundle.computeBounds();
        return Result<void>();
    });
}

/// A film whose tables read their views when they are asked for.
std::unique_ptr<Sequence> readLater(std::unique_ptr<Sequence> frames) {
    ViewChange nothing;
    nothing.change = [](ReferenceView&, Job&) { return Result<void>(); };
    nothing.takes = {"nothing", 0};
    return changedByView(std::move(frames), nothing);
}

void expectCountedFromOrigin(const Bundle& is, const Bundle& was) {
    EXPECT_NE(is.origin, glm::dvec3(0.0));
    for (std::size_t i = 0; i < is.views.size(); ++i) {
        EXPECT_EQ(is.views[i].camera.position + is.origin, was.views[i].camera.position);
        EXPECT_LT(glm::length(is.views[i].camera.position), 1000);
    }
    ASSERT_EQ(is.bounds.has_value(), was.bounds.has_value());
    if (is.bounds) {
        EXPECT_LT(glm::length(is.bounds->min + is.origin - was.bounds->min), 1e-6);
    }
}

TEST(FromOrigin, CamerasAndBoundsCountFromTheSameInAllFrames) {
    for (const bool bounds : {false, true}) {
        for (const bool later : {false, true}) {
            Job job;
            auto frames = farViews(kFar, bounds);
            if (later) frames = readLater(std::move(frames));
            const auto moved = fromOrigin(std::move(frames));
            const auto truth = farViews(kFar, bounds);
            std::optional<glm::dvec3> origin;
            for (const std::size_t i : {2, 0, 1}) {
                const auto frame = moved->frame(i, job);
                ASSERT_TRUE(frame) << frame.error().text();
                const Bundle was = *truth->frame(i, job);
                expectCountedFromOrigin(*frame, was);
                if (!origin) origin = frame->origin;
                EXPECT_EQ(frame->origin, *origin);
                const auto table = moved->views(i, job);
                ASSERT_TRUE(table) << table.error().text();
                expectCountedFromOrigin(std::as_const(**table).about(), was);
                EXPECT_EQ(std::as_const(**table).about().origin, *origin);
                for (std::size_t k = 0; k < was.views.size(); ++k) {
                    const auto view = (*table)->view(k, job);
                    ASSERT_TRUE(view) << view.error().text();
                    EXPECT_EQ((*view)->camera, frame->views[k].camera);
                    EXPECT_EQ((*view)->depth, was.views[k].depth);
                }
            }
        }
    }
}

/// A film each frame of which counts from a place of its own, and is in the world where the moving
/// views are.
std::unique_ptr<Sequence> ownOrigins() {
    return changed(std::make_unique<MovingViews>(3), [](Bundle& bundle, Job&) {
        bundle.bounds = bundle.computeBounds();
        bundle.origin = glm::dvec3(1000 * *bundle.time, 5, 0);
        for (ReferenceView& view : bundle.views) view.camera.position -= bundle.origin;
        bundle.bounds->min -= bundle.origin;
        bundle.bounds->max -= bundle.origin;
        return Result<void>();
    });
}

TEST(FromOrigin, FramesWithOriginsOfTheirOwnCountFromOne) {
    TemporaryFolder folder("origins");
    Job job;
    const glm::dvec3 start(0, 5, 0);
    const auto moved = fromOrigin(ownOrigins(), start);
    const auto film = folder / "f_%d.exr";
    ASSERT_TRUE(saveSequence(*ownOrigins(), film, {}, job));
    const auto read = openSequence(film, {}, job);
    ASSERT_TRUE(read) << read.error().text();
    ASSERT_TRUE(saveSequence(**read, folder / "film.mp4", {}, job));
    const auto scene = openSequence(folder / "film.mp4", {}, job);
    ASSERT_TRUE(scene) << scene.error().text();
    MovingViews truth(3);
    for (Sequence* frames : {moved.get(), read->get(), scene->get()}) {
        for (const std::size_t i : {2, 0, 1}) {
            const Bundle was = *truth.frame(i, job), is = *frames->frame(i, job);
            const auto table = *frames->views(i, job);
            EXPECT_EQ(is.origin, start);
            EXPECT_EQ(std::as_const(*table).about().origin, start);
            for (std::size_t k = 0; k < was.views.size(); ++k) {
                const auto position = was.views[k].camera.position - start;
                EXPECT_LT(glm::distance(is.views[k].camera.position, position), 1e-5) << i;
                EXPECT_LT(glm::distance((*table->view(k, job))->camera.position, position), 1e-5);
            }
            ASSERT_TRUE(is.bounds);
            EXPECT_LE(is.bounds->min.x + is.origin.x, was.computeBounds().min.x + 1e-5);
            EXPECT_LT(glm::distance(is.bounds->min, std::as_const(*table).about().bounds->min),
                      1e-9);
        }
    }
}

TEST(FromOrigin, MpegFourCountsAllFramesFromOne) {
    TemporaryFolder folder("origins_of_frames");
    Job job;
    const auto film = folder / "film.mp4";
    const auto saved = saveSequence(*ownOrigins(), film, {}, job);
    ASSERT_TRUE(saved) << saved.error().text();
    EXPECT_EQ(job.takeNotes(), std::vector<std::string>{});
    const auto read = openSequence(film, {}, job);
    ASSERT_TRUE(read) << read.error().text();
    MovingViews truth(3);
    for (std::size_t i = 0; i < 3; ++i) {
        const Bundle was = *truth.frame(i, job), is = *(*read)->frame(i, job);
        EXPECT_EQ(is.origin, glm::dvec3(0, 5, 0));
        for (std::size_t k = 0; k < was.views.size(); ++k)
            EXPECT_LT(glm::distance(is.views[k].camera.position + is.origin,
                                    was.views[k].camera.position),
                      1e-5);
    }
}

/// Frames `from` on of views at a distance that floats do not hold.
std::unique_ptr<Sequence> farFrames(bool bounds, std::vector<std::size_t> numbers) {
    auto frames = farViews(kFar + glm::dvec3(0.123, 0, 0.456), bounds);
    return std::move(*someFrames(std::move(frames), std::move(numbers)));
}

TEST(FromOrigin, MpegFourCountsWhatIsFarFromAnOrigin) {
    TemporaryFolder folder("far_in_mpeg4");
    for (const bool bounds : {false, true})
        for (const char* name : {"a.mp4", "a.bt", "a.xmt"})
            for (const std::vector<std::size_t>& numbers :
                 {std::vector<std::size_t>{1}, std::vector<std::size_t>{0, 1, 2}}) {
                SCOPED_TRACE(fmt::format("{} {} {}", bounds, name, numbers.size()));
                Job job;
                const auto saved =
                    saveSequence(*farFrames(bounds, numbers), folder / name, {}, job);
                ASSERT_TRUE(saved) << saved.error().text();
                const auto notes = job.takeNotes();
                ASSERT_EQ(notes.size(), 1u);
                EXPECT_TRUE(notes[0].starts_with(
                    "the coordinates are too large for 32-bit floats: the origin "));
                const auto read = openSequence(folder / name, {}, job);
                ASSERT_TRUE(read) << read.error().text();
                const auto truth = farFrames(bounds, numbers);
                for (std::size_t i = 0; i < numbers.size(); ++i) {
                    const Bundle was = *truth->frame(i, job), is = *(*read)->frame(i, job);
                    ASSERT_EQ(is.views.size(), was.views.size());
                    for (std::size_t k = 0; k < was.views.size(); ++k) {
                        EXPECT_LT(glm::distance(is.views[k].camera.position + is.origin,
                                                was.views[k].camera.position),
                                  1e-5);
                        EXPECT_EQ(is.views[k].depth, was.views[k].depth);
                    }
                    ASSERT_TRUE(is.bounds);
                    EXPECT_LT(glm::length(is.bounds->centre()), 1000);
                }
            }
}

TEST(FromOrigin, WhatFloatsHoldWellStaysAsItIs) {
    Job job;
    const auto moved = fromOrigin(farViews(glm::dvec3(10, 20, 30), false));
    const Bundle frame = *moved->frame(0, job);
    EXPECT_EQ(frame.origin, glm::dvec3(0.0));
    EXPECT_EQ(frame.views[0].camera,
              farViews(glm::dvec3(10, 20, 30), false)->frame(0, job)->views[0].camera);
}

}  // namespace
}  // namespace stx
