#include "formats/images/frames.hpp"

#include <gtest/gtest.h>

#include "formats/exr/bundle_exr.hpp"
#include "formats/exr/exr_file.hpp"
#include "formats/images/images.hpp"
#include "lib/base/parallel.hpp"
#include "lib/geometry/depth_code.hpp"
#include "lib/model/texture.hpp"
#include "tests/temporary_folder.hpp"

namespace stx {
namespace {

namespace fs = std::filesystem;

/// Opaque red, half-covered green, nothing.
Frame threePixels(bool linear) {
    Frame frame;
    frame.linear = linear;
    frame.colour = Image<glm::vec4>(3, 1);
    frame.colour.at(0, 0) = {0.5f, 0, 0, 1};
    frame.colour.at(1, 0) = {0, 0.25f, 0, 0.5f};
    frame.depth = Image<float>(3, 1, kNoDepth);
    frame.depth.at(0, 0) = 1.1f;
    frame.normal = Image<glm::vec3>(3, 1);
    frame.normal.at(0, 0) = {0, 0, 1};
    return frame;
}

std::vector<std::uint8_t> decoded8(const Result<Bytes>& bytes, int channels) {
    EXPECT_TRUE(bytes) << bytes.error().text();
    const auto image = decodeImage(*bytes, "frame", Limits());
    EXPECT_TRUE(image) << image.error().text();
    EXPECT_EQ(image->channels, channels);
    return std::get<0>(image->values);
}

Result<Bytes> encoded(const Frame& frame, FrameFormat format, const FrameOptions& options = {}) {
    return encodePicture(pictureOf(frame, format, options.background), format, options);
}

TEST(FrameFormat, GoesByTheEnding) {
    EXPECT_EQ(*frameFormat("a.PNG"), FrameFormat::png);
    EXPECT_EQ(*frameFormat("a.b/c.jpeg"), FrameFormat::jpeg);
    EXPECT_EQ(*frameFormat("c.exr"), FrameFormat::exr);
    EXPECT_EQ(*frameFormat("-"), FrameFormat::png);
    EXPECT_EQ(*frameFormat("c.TIF"), FrameFormat::tiff);
    EXPECT_EQ(*frameFormat("c.webp"), FrameFormat::webp);
    EXPECT_EQ(frameFormat("a.gif").error().code, ErrorCode::usage);
    EXPECT_EQ(frameFormat("png").error().code, ErrorCode::usage);
}

TEST(Frames, PngHasStraightAlpha) {
    EXPECT_EQ(decoded8(encoded(threePixels(false), FrameFormat::png), 4),
              (std::vector<std::uint8_t>{128, 0, 0, 255, 0, 128, 0, 128, 0, 0, 0, 0}));
}

TEST(Frames, LinearFramesAreCoded) {
    EXPECT_EQ(decoded8(encoded(threePixels(true), FrameFormat::png), 4),
              (std::vector<std::uint8_t>{188, 0, 0, 255, 0, 188, 0, 128, 0, 0, 0, 0}));
}

TEST(Frames, BackgroundIsPutBehind) {
    FrameOptions options;
    options.background = glm::vec3(1, 1, 1);
    EXPECT_EQ(decoded8(encoded(threePixels(false), FrameFormat::png, options), 3),
              (std::vector<std::uint8_t>{128, 0, 0, 128, 191, 128, 255, 255, 255}));
    // In linear light: (0.5, 0.75, 0.5), coded.
    EXPECT_EQ(decoded8(encoded(threePixels(true), FrameFormat::png, options), 3),
              (std::vector<std::uint8_t>{188, 0, 0, 188, 225, 188, 255, 255, 255}));
}

TEST(Frames, JpegHasBlackBehindUnlessTold) {
    Frame frame;
    frame.colour = Image<glm::vec4>(16, 16);
    EXPECT_EQ(decoded8(encoded(frame, FrameFormat::jpeg), 3)[100], 0);
    FrameOptions options;
    options.background = glm::vec3(1, 1, 1);
    EXPECT_EQ(decoded8(encoded(frame, FrameFormat::jpeg, options), 3)[100], 255);
}

TEST(Frames, ExrHoldsLinearLightDepthAndNormals) {
    const TemporaryFolder folder;
    Frame frame = threePixels(false);
    frame.albedo = frame.colour;
    FrameOptions options;
    options.camera = Camera::fromFieldOfView({1, 2, 3}, {1, 0, 0, 0}, {1, 0.4}, false, 3, 1);
    const auto written = writeFrame(frame, folder / "a.exr", options);
    ASSERT_TRUE(written) << written.error().text();
    const auto reader = ExrReader::open(folder / "a.exr", Limits());
    ASSERT_TRUE(reader) << reader.error().text();
    ASSERT_EQ(reader->parts().size(), 1u);
    EXPECT_EQ(reader->parts()[0].name, "");
    EXPECT_EQ(reader->parts()[0].channels.size(), 12u);
    std::vector<float> green(3), alpha(3), z(3), nz(3), albedo(3);
    ASSERT_TRUE(reader->readPart(0, {{"G", green.data(), 1},
                                     {"A", alpha.data(), 1},
                                     {"Z", z.data(), 1},
                                     {"N.Z", nz.data(), 1},
                                     {"albedo.G", albedo.data(), 1}}));
    EXPECT_NEAR(green[1], linearFromSrgb(0.5f) * 0.5f, 1e-4f);
    EXPECT_EQ(alpha, (std::vector<float>{1, 0.5f, 0}));
    EXPECT_EQ(z, (std::vector<float>{1.1f, kNoDepth, kNoDepth}));
    EXPECT_EQ(nz, (std::vector<float>{1, 0, 0}));
    EXPECT_EQ(albedo, green);
    const auto view = exrCamera(reader->parts()[0]);
    ASSERT_TRUE(view);
    EXPECT_NEAR(view->camera.fy, options.camera->fy, 1e-5);
    EXPECT_LT(glm::length(view->camera.position - options.camera->position), 1e-6);
}

TEST(Frames, AreWrittenWholeFromManyThreads) {
    const TemporaryFolder folder;
    std::vector<int> good(24, 0);
    parallelFor(0, 24, [&](std::int64_t i) {
        Frame frame;
        frame.colour = Image<glm::vec4>(64, 64, glm::vec4(static_cast<float>(i) / 24.0f));
        frame.depth = Image<float>(64, 64, static_cast<float>(i));
        const char* ending[] = {"png", "exr", "jpg"};
        good[i] = writeFrame(frame, folder / fmt::format("f_{}.{}", i, ending[i % 3])).has_value();
    });
    EXPECT_EQ(std::count(good.begin(), good.end(), 1), 24);
    int files = 0;
    for (const auto& entry : fs::directory_iterator(folder.path())) {
        EXPECT_TRUE(entry.path().filename().string().starts_with("f_"));
        ++files;
    }
    EXPECT_EQ(files, 24);
}

TEST(Frames, NoClobberAndEmptyFrames) {
    const TemporaryFolder folder;
    FrameOptions options;
    options.noClobber = true;
    EXPECT_TRUE(writeFrame(threePixels(false), folder / "a.png", options));
    EXPECT_FALSE(writeFrame(threePixels(false), folder / "a.png", options));
    EXPECT_FALSE(writeFrame(Frame(), folder / "b.png"));
}

}  // namespace
}  // namespace stx
