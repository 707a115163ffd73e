#include "formats/video/video_frames.hpp"

#include <gtest/gtest.h>

#include "formats/images/frames.hpp"
#include "formats/images/images.hpp"
#include "formats/video/numbered_pictures.hpp"
#include "formats/video/video_process.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/y4m_text.hpp"

namespace stx {
namespace {

namespace fs = std::filesystem;

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
    // Of a kind that is not read here, too.
    TemporaryFolder kinds;
    for (const char* name : {"q0.png", "q1.png", "q2.heic"}) writePng(kinds / name, ramp(4, 4));
    const auto other = errorOf({kinds.path()}, ErrorCode::invalidInput);
    EXPECT_TRUE(has(other, "2 sequences: q#.heic (1 picture), q#.png (2 pictures)")) << other;
    TemporaryFolder empty;
    EXPECT_TRUE(has(errorOf({empty.path()}, ErrorCode::invalidInput), "no numbered pictures"));
}

TEST(VideoFrames, TheFrameBeforeADamagedOneStandsForIt) {
    TemporaryFolder folder;
    writeText(folder / "f1.png", "damaged");
    for (const int k : {2, 3, 5}) writePng(folder / fmt::format("f{}.png", k), ramp(8, 6, k));
    writeText(folder / "f4.png", "\x89PNG\r\n\x1a\n and then nothing");
    Job job;
    {
        const auto frames = openVideoFrames({folder.path()}, job);
        ASSERT_TRUE(frames) << frames.error().text();
        ASSERT_EQ((*frames)->count(), 5);
        const int shown[] = {2, 2, 3, 3, 5};  // before the first there is the one after
        for (int k = 0; k < 5; ++k) {
            const auto frame = (*frames)->frame(k);
            ASSERT_TRUE(frame) << frame.error().text();
            EXPECT_EQ((*frame)->at(0, 0).r, 40 + shown[k]);
        }
    }
    const auto notes = job.takeNotes();
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_TRUE(has(notes[0], "2 of 5 frames cannot be used, and the frame before takes its place"))
        << notes[0];
    EXPECT_FALSE(openVideoFrames({folder.path()}, job, true));
}

TEST(VideoFrames, DamagedFramesAreReadOnceAndCountedWhereTheyAreAskedFor) {
    TemporaryFolder folder;
    constexpr int kFrames = 60, kSound = 20;
    for (int k = 0; k < kFrames; ++k) {
        const auto file = folder / fmt::format("f{:02}.png", k);
        if (k < kSound)
            writePng(file, ramp(8, 6, k));
        else
            writeText(file, "\x89PNG\r\n\x1a\n and then nothing");
    }
    Job job;
    {
        const auto frames = openVideoFrames({folder.path()}, job);
        ASSERT_TRUE(frames) << frames.error().text();
        VideoFrames& f = **frames;
        EXPECT_EQ(f.shownFor(40), 40) << "nobody has read it";
        ASSERT_TRUE(f.frame(40));
        // What it was found on the way to is known, and the files are not needed any more.
        for (int k = kSound; k <= 40; ++k) {
            EXPECT_EQ(f.shownFor(k), kSound - 1);
            fs::remove(folder / fmt::format("f{:02}.png", k));
        }
        for (const int k : {30, 40, 41, 59}) {
            const auto frame = f.frame(k);
            ASSERT_TRUE(frame) << frame.error().text();
            EXPECT_EQ((*frame)->at(0, 0).r, 40 + kSound - 1);
        }
        EXPECT_EQ(f.shownFor(3), 3);
    }
    const auto notes = job.takeNotes();
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_TRUE(has(notes[0], "4 of 60 frames cannot be used")) << notes[0];
    EXPECT_TRUE(has(notes[0], "f30.png")) << notes[0];
}

TEST(VideoFrames, WhatEightBitsLoseIsNotedOnceWhicheverFrameItIsOf) {
    TemporaryFolder folder;
    const auto notesOf = [&](const fs::path& input, int count) {
        Job job;
        {
            const auto frames = openVideoFrames({input}, job);
            EXPECT_TRUE(frames) << frames.error().text();
            for (int k = 0; frames && k < 2 * count; ++k) EXPECT_TRUE((*frames)->frame(k % count));
        }
        return job.takeNotes();
    };
    for (const int k : {0, 2}) writePng(folder / fmt::format("deep{}.png", k), ramp(4, 4));
    const std::vector<std::uint16_t> deep(4 * 4 * 3, 0x8012);
    ASSERT_TRUE(writeFile(folder / "deep1.png", *encodePng(4, 4, 3, 16, deep.data(), true)));
    EXPECT_EQ(notesOf(folder / "deep%d.png", 3),
              std::vector<std::string>{"colour of 16 bits is rounded to 8"});
    for (const float peak : {1.0f, 4.0f}) {
        for (const int k : {0, 1, 2}) {
            Frame frame;
            frame.colour = Image<glm::vec4>(4, 4, glm::vec4(0.5f, 0.5f, 0.5f, 1.0f));
            if (k == 1) frame.colour.at(2, 3).g = peak;
            ASSERT_TRUE(writeFrame(frame, folder / fmt::format("light{}.exr", k), {}));
        }
        EXPECT_EQ(notesOf(folder / "light%d.exr", 3),
                  std::vector<std::string>{
                      peak > 1 ? "linear colour becomes 8-bit sRGB; values above 1 are clipped"
                               : "linear colour becomes 8-bit sRGB"});
    }
    writeText(folder / "ten.y4m",
              std::string_view("YUV4MPEG2 W1 H1 Cmono10\nFRAME\n\0\2FRAME\n\1\2", 40));
    EXPECT_EQ(notesOf(folder / "ten.y4m", 2),
              std::vector<std::string>{"colour of 10 bits is rounded to 8"});
}

TEST(VideoFrames, ASizeThatChangesAndABrokenPictureAreNamed) {
    TemporaryFolder folder;
    writePng(folder / "f1.png", ramp(8, 6));
    writePng(folder / "f2.png", ramp(6, 8));
    writeText(folder / "f3.png", "\x89PNG\r\n\x1a\n and then nothing");
    Job job;
    const auto frames = openVideoFrames({folder.path()}, job, true);
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
    if (VideoProcess::start(Limits())) {
        EXPECT_TRUE(has(errorOf({folder / "clip.bin"}, ErrorCode::invalidInput),
                        "clip.bin': it is cut off: it should have 24 bytes, and has 12"));
    }
    writeText(folder / "clip.AVI", "anything");
    const auto avi = errorOf({folder / "clip.AVI"}, ErrorCode::unsupported);
    EXPECT_TRUE(has(avi, "ffmpeg -i") && has(avi, "frame_%04d.png")) << avi;
    EXPECT_TRUE(has(errorOf({folder / "a.png", folder.path()}, ErrorCode::usage), "is a folder"));
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
