// Views as pictures with depth for programs that take one photograph.
#include "formats/imagesets/export_picture.hpp"

#include <gtest/gtest.h>

#include "formats/images/images.hpp"
#include "tests/temporary_folder.hpp"

namespace {

using namespace stx;

/// Four pixels: near, a fifth of the way in 1 / distance, far, and none; the last is half covered.
ReferenceView view() {
    ReferenceView v;
    v.name = "v";
    v.camera = Camera::fromFieldOfView({}, {1, 0, 0, 0}, {1, 0.5}, false, 4, 1);
    v.depth = Image<float>(4, 1);
    Rgba8Image colour(4, 1);
    const float distances[] = {1.0f, 2.5f, 4.0f, kNoDepth};
    for (int x = 0; x < 4; ++x) {
        v.depth.at(x, 0) = distances[x];
        colour.at(x, 0) = {200, 100, 10 * x, x == 3 ? 128 : 255};
    }
    v.texture = Texture(std::move(colour));
    return v;
}

TEST(DepthPictures, HaveColourOnTheLeftAndWhiteNearOnTheRight) {
    const TemporaryFolder folder;
    Job job;
    ASSERT_TRUE(
        exportPicture(view(), folder / "v_rgbd.png", DepthPicture::sideBySide, 92, {}, job));
    const auto bytes = readFile(folder / "v_rgbd.png", Limits());
    ASSERT_TRUE(bytes);
    const auto picture = decodeRgba8(*bytes, "v", Limits());
    ASSERT_TRUE(picture);
    ASSERT_EQ(picture->size(), glm::ivec2(8, 1));
    EXPECT_EQ(picture->at(1, 0), glm::u8vec4(200, 100, 10, 255));
    // Half covered: black is behind it.
    EXPECT_EQ(picture->at(3, 0), glm::u8vec4(100, 50, 15, 255));
    const int greys[] = {255, 51, 0, 0};
    for (int x = 0; x < 4; ++x)
        EXPECT_EQ(picture->at(4 + x, 0), glm::u8vec4(glm::u8vec3(greys[x]), 255)) << x;
    const auto notes = job.takeNotes();
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_NE(notes[0].find("black is 4, white 1 scene units"), std::string::npos);
}

TEST(DepthPictures, ArePairsOfOneSize) {
    const TemporaryFolder folder;
    Job job;
    ASSERT_TRUE(exportPicture(view(), folder / "v.png", DepthPicture::pair, 92, {}, job));
    EXPECT_EQ(depthFileOf("a/b.c.jpg"), "a/b.c_depth.jpg");
    const auto depth = readFile(folder / "v_depth.png", Limits());
    ASSERT_TRUE(depth);
    const auto info = probeImage(*depth);
    ASSERT_TRUE(info);
    EXPECT_EQ(glm::ivec3(info->width, info->height, info->channels), glm::ivec3(4, 1, 1));
    const auto grey = decodeRgba8(*depth, "v", Limits());
    ASSERT_TRUE(grey);
    EXPECT_EQ(grey->at(1, 0).r, 51);
}

TEST(DepthPictures, SayWhatLinearColoursLose) {
    const TemporaryFolder folder;
    for (const float bright : {1.0f, 4.0f}) {
        ReferenceView linear = view();
        RgbaFloatImage colour(4, 1, glm::vec4(0.5f, 0.5f, 0.5f, 1.0f));
        colour.at(1, 0).g = bright;
        // What nobody sees does not count.
        colour.at(3, 0) = glm::vec4(9.0f, 9.0f, 9.0f, 0.0f);
        linear.texture = Texture(std::move(colour));
        Job job;
        ASSERT_TRUE(
            exportPicture(linear, folder / "v_rgbd.png", DepthPicture::sideBySide, 92, {}, job));
        const auto notes = job.takeNotes();
        ASSERT_EQ(notes.size(), 2u);
        EXPECT_EQ(notes[1], bright > 1
                                ? "linear colour becomes 8-bit sRGB; values above 1 are clipped"
                                : "linear colour becomes 8-bit sRGB");
    }
}

TEST(DepthPictures, AreOfViewsWithDepth) {
    const TemporaryFolder folder;
    Job job;
    ReferenceView none = view();
    none.depth = Image<float>(4, 1, kNoDepth);
    const auto done = exportPicture(none, folder / "n.png", DepthPicture::pair, 92, {}, job);
    ASSERT_FALSE(done);
    EXPECT_EQ(done.error().code, ErrorCode::invalidInput);
    EXPECT_FALSE(std::filesystem::exists(folder / "n_depth.png"));
    // One distance has no farthest.
    none.depth = Image<float>(4, 1, 2.0f);
    ASSERT_TRUE(exportPicture(none, folder / "o.png", DepthPicture::pair, 92, {}, job));
}

}  // namespace
