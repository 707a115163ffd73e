// Frames of a film that are packed alike.

#include "lib/packing/period.hpp"

#include "lib/packing/packing.hpp"
#include "tests/torus_bundle.hpp"
#include "tests/unit/packing/holes.hpp"
#include "tests/unit/surface/analytic.hpp"

namespace stx {
namespace {

std::vector<Bundle> movingTorus() {
    std::vector<Bundle> frames;
    for (const double up : {0.0, 0.12, 0.24}) frames.push_back(torusViews(128, {0, up, 0}));
    return frames;
}

TEST(PackPeriod, FramesShareRectanglesAndKeepWhatEachNeeds) {
    const auto frames = movingTorus();
    Job job;
    PackPeriod period;
    std::vector<Bundle> alone;
    for (const Bundle& frame : frames) {
        Bundle& pruned = alone.emplace_back(frame);
        ASSERT_TRUE(prune(pruned, {}, job));
        const auto added = period.add(frame, pruned);
        ASSERT_TRUE(added) << added.error().text();
    }
    const Bundle content = period.content();
    PackSettings settings;
    settings.layout = PackSettings::Layout::tight;
    std::vector<AtlasRectangle> rectangles;
    for (std::size_t f = 0; f < frames.size(); ++f) {
        Bundle frame = frames[f];
        const auto report = period.prune(frame);
        EXPECT_EQ(report.sourcePixels, frames[f].pointCount());
        EXPECT_EQ(report.sourcePoints, frames[f].pointCount());
        EXPECT_EQ(report.keptPixels, frame.pointCount());
        EXPECT_LT(report.keptPixels, report.sourcePixels * 9 / 10);
        for (std::size_t v = 0; v < frame.views.size(); ++v)
            for (std::size_t i = 0; i < frame.views[v].depth.count(); ++i)
                ASSERT_TRUE(!hasPoint(alone[f].views[v].depth.data()[i]) ||
                            hasPoint(frame.views[v].depth.data()[i]));
        settings.contentOf = &content;
        settings.sourcePixels = report.sourcePixels;
        const auto atlas = pack(frame, settings, job);
        ASSERT_TRUE(atlas) << atlas.error().text();
        if (f == 0) rectangles = atlas->rectangles;
        EXPECT_EQ(atlas->rectangles, rectangles);
        const auto unpacked = unpack(*atlas, job);
        ASSERT_TRUE(unpacked);
        // Without the period's content, rectangles follow each frame.
        settings.contentOf = nullptr;
        const auto own = pack(frame, settings, job);
        ASSERT_TRUE(own);
        EXPECT_NE(own->rectangles, rectangles);
        for (std::size_t v = 0; v < frame.views.size(); ++v)
            EXPECT_EQ(unpacked->views[v].depth, frame.views[v].depth);
        const Camera camera = analytic::lookingAt({1, 2, 2}, 128);
        EXPECT_EQ(holes(draw(frames[f], camera), draw(*unpacked, camera)), 0);
    }
}

TEST(PackPeriod, AViewThatSeesNothingStays) {
    Bundle frame = torusViews(64);
    ReferenceView& blind = frame.views[2];
    for (float& depth : blind.depth.pixels()) depth = kNoDepth;
    for (glm::u8vec4& colour : blind.texture.rgba8()->pixels()) colour.a = 0;
    Job job;
    PackPeriod period;
    ASSERT_TRUE(period.add(frame, frame));
    const Bundle content = period.content();
    PackSettings settings;
    settings.layout = PackSettings::Layout::tight;
    settings.contentOf = &content;
    const auto atlas = pack(frame, settings, job);
    ASSERT_TRUE(atlas) << atlas.error().text();
    EXPECT_EQ(atlas->views.size(), frame.views.size());
    EXPECT_TRUE(job.takeNotes().empty());
    const auto unpacked = unpack(*atlas, job);
    ASSERT_TRUE(unpacked) << unpacked.error().text();
    ASSERT_EQ(unpacked->views.size(), frame.views.size());
    for (std::size_t v = 0; v < frame.views.size(); ++v)
        EXPECT_EQ(unpacked->views[v].depth, frame.views[v].depth);
    const Camera camera = analytic::lookingAt({1, 2, 2}, 96);
    EXPECT_EQ(holes(draw(frame, camera), draw(*unpacked, camera)), 0);
}

TEST(PackPeriod, OtherViewsAreRefused) {
    Job job;
    PackPeriod period;
    const Bundle frame = torusViews(32);
    ASSERT_TRUE(period.add(frame, frame));
    const auto wrong = period.add(torusViews(48), torusViews(48));
    ASSERT_FALSE(wrong);
    EXPECT_EQ(wrong.error().code, ErrorCode::invalidInput);
    const Bundle content = period.content();
    PackSettings settings;
    settings.contentOf = &content;
    const auto other = pack(torusViews(48), settings, job);
    ASSERT_FALSE(other);
    EXPECT_EQ(other.error().code, ErrorCode::usage);
}

}  // namespace
}  // namespace stx
