#include "formats/video/video_frames.hpp"

#include <gtest/gtest.h>

#include "formats/images/images.hpp"
#include "formats/images/y4m.hpp"
#include "formats/video/numbered_pictures.hpp"
#include "formats/video/video_module.hpp"
#include "formats/video/y4m_reader.hpp"
#include "tests/temporary_folder.hpp"

namespace stx {
namespace {

namespace fs = std::filesystem;

Rgba8Image ramp(int width, int height, int k = 0) {
    Rgba8Image out(width, height);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            out.at(x, y) = {40 + x * 4 + k, 60 + y * 5, 150 - x - y, 255};
    return out;
}

void writePng(const fs::path& path, const Rgba8Image& image) {
    const auto png = encodePng(image.width(), image.height(), 4, 8, image.data(), true);
    ASSERT_TRUE(writeFile(path, *png));
}

void writeText(const fs::path& path, std::string_view text) {
    ASSERT_TRUE(writeFile(path, std::as_bytes(std::span(text))));
}

std::string errorOf(const std::vector<fs::path>& inputs, ErrorCode code) {
    Job job;
    const auto opened = openVideoFrames(inputs, job);
    EXPECT_FALSE(opened);
    if (opened) return {};
    EXPECT_EQ(opened.error().code, code) << opened.error().text();
    return opened.error().text();
}

bool has(const std::string& text, std::string_view part) {
    return text.find(part) != std::string::npos;
}

// ---- Pictures ----

TEST(VideoFrames, AFolderIsReadByRisingNumberWhateverTheDigits) {
    TemporaryFolder folder;
    for (const int k : {10, 9, 100, 8}) writePng(folder / fmt::format("f{}.png", k), ramp(8, 6, k));
    writePng(folder / "cover.png", ramp(3, 3));
    writeText(folder / "notes1.txt", "no picture");
    Job job;
    const auto frames = openVideoFrames({folder.path()}, job);
    ASSERT_TRUE(frames) << frames.error().text();
    ASSERT_EQ((*frames)->count(), 4);
    EXPECT_EQ((*frames)->size(), glm::ivec2(8, 6));
    const int order[] = {8, 9, 10, 100};
    for (int k = 0; k < 4; ++k) {
        EXPECT_EQ((*frames)->name(k), fmt::format("f{}", order[k]));
        EXPECT_EQ((*(*frames)->frame(k))->at(0, 0).r, 40 + order[k]);
    }
    const auto notes = job.takeNotes();
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_TRUE(has(notes[0], "89 frames are missing from the sequence, the first is number 11"))
        << notes[0];
}

TEST(VideoFrames, AStepThatAllNumbersShareIsNoGap) {
    TemporaryFolder folder;
    for (const int k : {0, 3, 6, 9}) writePng(folder / fmt::format("in{:06}.png", k), ramp(4, 4));
    Job job;
    EXPECT_EQ((*openVideoFrames({folder.path()}, job))->count(), 4);
    EXPECT_TRUE(job.takeNotes().empty());
}

TEST(VideoFrames, APatternTakesItsOwnNamesOnly) {
    TemporaryFolder folder;
    for (const char* name : {"a_0001.png", "a_0002.png", "a_3.png", "a_00004.png", "a_10000.png",
                             "b_0001.png", "a_0002.jpg"})
        writePng(folder / name, ramp(4, 4));
    Job job;
    const auto pictures = picturesOfPattern(folder / "a_%04d.png", job);
    ASSERT_TRUE(pictures);
    std::vector<std::string> names;
    for (const auto& p : *pictures) names.push_back(p.path.filename().string());
    EXPECT_EQ(names, (std::vector<std::string>{"a_0001.png", "a_0002.png", "a_10000.png"}));
    EXPECT_EQ(picturesOfPattern(folder / "a_%d.png", job)->size(), 2u);  // 3, 10000
    EXPECT_TRUE(has(errorOf({folder / "c_%04d.png"}, ErrorCode::io), "no file is named so"));
}

TEST(VideoFrames, SeveralSequencesInAFolderAreAQuestion) {
    TemporaryFolder folder;
    for (const char* name : {"colour_1.png", "colour_2.png", "depth_1.png"})
        writePng(folder / name, ramp(4, 4));
    const auto text = errorOf({folder.path()}, ErrorCode::invalidInput);
    EXPECT_TRUE(has(text, "2 sequences: colour_#.png (2 pictures), depth_#.png (1 picture)"))
        << text;
    TemporaryFolder empty;
    EXPECT_TRUE(has(errorOf({empty.path()}, ErrorCode::invalidInput), "no numbered pictures"));
}

TEST(VideoFrames, ASizeThatChangesAndABrokenPictureAreNamed) {
    TemporaryFolder folder;
    writePng(folder / "f1.png", ramp(8, 6));
    writePng(folder / "f2.png", ramp(6, 8));
    writeText(folder / "f3.png", "\x89PNG\r\n\x1a\n and then nothing");
    Job job;
    const auto frames = openVideoFrames({folder.path()}, job);
    ASSERT_TRUE(frames);
    const auto other = (*frames)->frame(1);
    ASSERT_FALSE(other);
    EXPECT_EQ(other.error().code, ErrorCode::invalidInput);
    EXPECT_TRUE(has(other.error().text(), "f2.png': it is 6x8, but the first frame"))
        << other.error().text();
    const auto broken = (*frames)->frame(2);
    ASSERT_FALSE(broken);
    EXPECT_TRUE(has(broken.error().text(), "f3.png'"));
}

TEST(VideoFrames, WhatIsNoFrameSaysWhatToDo) {
    TemporaryFolder folder;
    writePng(folder / "a.png", ramp(4, 4));
    EXPECT_TRUE(has(errorOf({folder / "a.png", folder / "b.png"}, ErrorCode::io), "b.png'"));
    writeText(folder / "clip.bin", std::string_view("\0\0\0\x18"
                                                    "ftypmp42",
                                                    12));
    if (videoModule().present) {
        EXPECT_TRUE(has(errorOf({folder / "clip.bin"}, ErrorCode::invalidInput),
                        "clip.bin': it is cut off: it should have 24 bytes, and has 12"));
    }
    writeText(folder / "clip.AVI", "anything");
    const auto avi = errorOf({folder / "clip.AVI"}, ErrorCode::unsupported);
    EXPECT_TRUE(has(avi, "ffmpeg -i") && has(avi, "frame_%04d.png")) << avi;
    EXPECT_TRUE(has(errorOf({folder / "a.png", folder.path()}, ErrorCode::usage), "is a folder"));
}

// ---- YUV4MPEG2 ----

std::string y4mText(const Rgba8Image& a, const Rgba8Image& b, const Y4mOptions& options) {
    std::string text = y4mHeader(a.width(), a.height(), options) + "\n";
    for (const auto* image : {&a, &b}) {
        const auto planes = y4mPlanes(*image, options);
        text += "FRAME\n";
        text.append(reinterpret_cast<const char*>(planes.data()), planes.size());
    }
    return text;
}

Result<Y4mReader> openText(std::string_view text, Job& job) {
    return Y4mReader::open(ByteSource::fromView(std::as_bytes(std::span(text))), job);
}

int largestDifference(const Rgba8Image& a, const Rgba8Image& b) {
    int most = 0;
    for (std::size_t i = 0; i < a.count(); ++i)
        for (int c = 0; c < 4; ++c)
            most = std::max(most, std::abs(a.pixels()[i][c] - b.pixels()[i][c]));
    return most;
}

TEST(Y4mReader, GivesBackWhatOurWriterWrote) {
    for (const auto chroma : {Y4mOptions::Chroma::yuv420, Y4mOptions::Chroma::yuv444}) {
        for (const bool full : {false, true}) {
            for (const glm::ivec2 size :
                 {glm::ivec2(12, 8), glm::ivec2(7, 5), glm::ivec2(2, 720)}) {
                Y4mOptions options;
                options.chroma = chroma;
                options.fullRange = full;
                const auto a = ramp(size.x, std::min(size.y, 20)),
                           b = ramp(size.x, std::min(size.y, 20), 9);
                const auto text = y4mText(a, b, options);
                Job job;
                const auto reader = openText(text, job);
                ASSERT_TRUE(reader) << reader.error().text();
                ASSERT_EQ(reader->count(), 2);
                const int room = chroma == Y4mOptions::Chroma::yuv444 ? 3 : 8;
                EXPECT_LE(largestDifference(*reader->frame(0, job.limits), a), room);
                EXPECT_LE(largestDifference(*reader->frame(1, job.limits), b), room);
            }
        }
    }
}

TEST(Y4mReader, TakesTheMatrixOfTheSize) {
    for (const int height : {718, 720}) {
        const Rgba8Image red(2, height, glm::u8vec4(200, 30, 20, 255));
        const auto text = y4mText(red, red, {});
        Job job;
        EXPECT_LE(largestDifference(*openText(text, job)->frame(1, job.limits), red), 3) << height;
    }
}

TEST(Y4mReader, ReadsLumaAloneManyBitsAndFrameParameters) {
    Job job;
    const auto grey = openText("YUV4MPEG2 W2 H1 Cmono XCOLORRANGE=FULL\nFRAME Ixyz\n\x10\x80", job);
    ASSERT_TRUE(grey) << grey.error().text();
    EXPECT_EQ((*grey->frame(0, job.limits)).at(1, 0), glm::u8vec4(128, 128, 128, 255));
    using std::string_view_literals::operator""sv;
    const auto ten = openText(
        "YUV4MPEG2 W1 H1 F25:1 C444p10 XCOLORRANGE=FULL\nFRAME\n"
        "\xff\x03\x00\x02\x00\x02"sv,
        job);
    ASSERT_TRUE(ten) << ten.error().text();
    EXPECT_EQ((*ten->frame(0, job.limits)).at(0, 0), glm::u8vec4(255, 255, 255, 255));
    const auto beyond = openText("YUV4MPEG2 W1 H1 Cmono10\nFRAME\n\xff\x04"sv, job);
    ASSERT_TRUE(beyond);
    const auto value = beyond->frame(0, job.limits);
    ASSERT_FALSE(value);
    EXPECT_TRUE(has(value.error().text(), "10 bits reach only to 1023")) << value.error().text();
    EXPECT_TRUE(job.takeNotes().empty());
    EXPECT_TRUE(openText("YUV4MPEG2 W1 H1 It Cmono\nFRAME\nx", job));
    EXPECT_EQ(job.takeNotes().size(), 1u);
}

TEST(Y4mReader, ErrorsSayWhere) {
    Job job;
    const struct {
        const char* text;
        const char* error;
    } cases[] = {
        {"YUV4MPEG W2 H2\n", "byte 0: it does not begin with YUV4MPEG2"},
        {"YUV4MPEG2 W2 H2", "byte 0: the line of the file has no end within 15 bytes"},
        {"YUV4MPEG2 W2\nFRAME\n", "byte 0: the first line does not say the height of the frames"},
        {"YUV4MPEG2 W0 H2\n", "byte 0: the width of the frames is '0'; 1 to 65535 is expected"},
        {"YUV4MPEG2 W2 H99999999999\n", "byte 0: the height of the frames is '99999999999'"},
        {"YUV4MPEG2 W2 H2x\n", "byte 0: the height of the frames is '2x'"},
        {"YUV4MPEG2 W2 H2 C411\n", "byte 0: pixels of the kind C411 are not read"},
        {"YUV4MPEG2 W2 H2 C420p99\n", "byte 0: pixels of the kind C420p99 are not read"},
        {"YUV4MPEG2 W2 H2\n", "byte 16: it holds no frame"},
        {"YUV4MPEG2 W2 H2 Cmono\nFRAME\nabcdFRAME\nabc",
         "byte 38: frame 1 is cut off: 3 bytes of 4 are here"},
        {"YUV4MPEG2 W2 H2 Cmono\nFRAME\nabcdefghijkl\n",
         "byte 32: frame 1 must begin with FRAME here, not with 'efghijkl'"},
        {"YUV4MPEG2 W2 H2 Cmono\nFRAMES\nabcd", "byte 22: frame 0 must begin with FRAME here"},
    };
    for (const auto& c : cases) {
        const auto reader = openText(c.text, job);
        ASSERT_FALSE(reader) << c.text;
        EXPECT_TRUE(has(reader.error().text(), c.error)) << reader.error().text();
    }
    // A claim of gigabytes costs nothing but its frame.
    job.limits.maxMemoryBytes = 1 << 20;
    EXPECT_FALSE(openText("YUV4MPEG2 W65535 H65535\nFRAME\nabc", job));
}

TEST(VideoFrames, AY4mFileIsReadFrameByFrame) {
    TemporaryFolder folder;
    const auto a = ramp(12, 8), b = ramp(12, 8, 9);
    writeText(folder / "clip.y4m", y4mText(a, b, {}));
    Job job;
    const auto frames = openVideoFrames({folder / "clip.y4m"}, job);
    ASSERT_TRUE(frames) << frames.error().text();
    EXPECT_EQ((*frames)->count(), 2);
    EXPECT_EQ((*frames)->name(1), "clip_0001");
    EXPECT_LE(largestDifference(**(*frames)->frame(1), b), 8);
    EXPECT_TRUE(
        has(errorOf({folder / "clip.y4m", folder / "clip.y4m"}, ErrorCode::usage), "is a video"));
    writeText(folder / "cut.y4m", y4mText(a, b, {}).substr(0, 200));
    EXPECT_TRUE(has(errorOf({folder / "cut.y4m"}, ErrorCode::invalidInput), "cut.y4m': byte"));
}

}  // namespace
}  // namespace stx
