// Uncompressed video: what is written, and what is read back.
#include "formats/yuv/y4m_reader.hpp"

#include <gtest/gtest.h>

#include "tests/temporary_folder.hpp"
#include "tests/y4m_text.hpp"

namespace stx {
namespace {

std::vector<int> intsOf(const Bytes& bytes) {
    std::vector<int> ints;
    for (const auto b : bytes) ints.push_back(std::to_integer<int>(b));
    return ints;
}

TEST(Y4m, CodesKnownColours) {
    Image<glm::u8vec4> image(1, 1);
    Y4mOptions options;
    options.chroma = Y4mOptions::Chroma::yuv444;
    const auto coded = [&](glm::u8vec4 p) {
        image.at(0, 0) = p;
        return intsOf(y4mPlanes(image, options));
    };
    // The colour bars of ITU-R BT.601 and BT.709 at 100 %.
    EXPECT_EQ(coded({255, 255, 255, 255}), (std::vector<int>{235, 128, 128}));
    EXPECT_EQ(coded({0, 0, 0, 255}), (std::vector<int>{16, 128, 128}));
    EXPECT_EQ(coded({255, 0, 0, 255}), (std::vector<int>{81, 90, 240}));
    EXPECT_EQ(coded({0, 255, 0, 255}), (std::vector<int>{145, 54, 34}));
    EXPECT_EQ(coded({0, 0, 255, 255}), (std::vector<int>{41, 240, 110}));
    options.matrix = Y4mOptions::Matrix::bt709;
    EXPECT_EQ(coded({255, 0, 0, 255}), (std::vector<int>{63, 102, 240}));
    EXPECT_EQ(coded({0, 255, 0, 255}), (std::vector<int>{173, 42, 26}));
    options.fullRange = true;
    EXPECT_EQ(coded({255, 255, 255, 255}), (std::vector<int>{255, 128, 128}));
}

TEST(Y4m, AStreamHasHeaderFramesAndRoundedUpChroma) {
    const TemporaryFolder folder;
    auto file = OutputFile::create(folder / "a.y4m");
    ASSERT_TRUE(file);
    Y4mOptions options;
    options.rateNumerator = 25;
    auto writer = Y4mWriter::create(*file, 3, 1, options);
    ASSERT_TRUE(writer);
    Rgba8Image picture(3, 1, glm::u8vec4(0, 0, 0, 255));
    picture.at(0, 0) = {128, 0, 0, 255};
    ASSERT_TRUE(writer->write(picture));
    ASSERT_TRUE(writer->write(picture));
    EXPECT_FALSE(writer->write(Image<glm::u8vec4>(4, 1)));
    ASSERT_TRUE(file->commit());
    const auto bytes = readFile(folder / "a.y4m", Limits());
    ASSERT_TRUE(bytes);
    const std::string text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
    const std::string header = "YUV4MPEG2 W3 H1 F25:1 Ip A1:1 C420jpeg XCOLORRANGE=LIMITED\n";
    EXPECT_EQ(text.substr(0, header.size()), header);
    EXPECT_EQ(text.substr(header.size(), 6), "FRAME\n");
    EXPECT_EQ(text.size(), header.size() + 2 * (6 + 3 + 2 + 2));
    // The last pixel is black.
    EXPECT_EQ(static_cast<unsigned char>(text[header.size() + 6 + 2]), 16);
}

bool has(const std::string& text, std::string_view part) {
    return text.find(part) != std::string::npos;
}

Result<Y4mReader> openText(std::string_view text, Job& job) {
    const auto bytes = std::as_bytes(std::span(text));
    return Y4mReader::open(ByteSource::fromBytes(Bytes(bytes.begin(), bytes.end())), job);
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

TEST(Y4mReader, LumaAloneIsOfFullRangeUnlessItSaysOtherwise) {
    using std::string_view_literals::operator""sv;
    const auto greyOf = [](std::string_view text) {
        Job job;
        const auto reader = openText(text, job);
        EXPECT_TRUE(reader) << reader.error().text();
        return reader ? static_cast<int>((*reader->frame(0, job.limits)).at(0, 0).g) : -1;
    };
    EXPECT_EQ(greyOf("YUV4MPEG2 W1 H1 Cmono\nFRAME\n\x20"), 32);
    EXPECT_EQ(greyOf("YUV4MPEG2 W1 H1 Cmono XCOLORRANGE=FULL\nFRAME\n\x20"), 32);
    EXPECT_EQ(greyOf("YUV4MPEG2 W1 H1 Cmono XCOLORRANGE=LIMITED\nFRAME\n\x20"), 19);
    EXPECT_EQ(greyOf("YUV4MPEG2 W1 H1 Cmono10\nFRAME\n\xff\x03"sv), 255);
    EXPECT_EQ(greyOf("YUV4MPEG2 W1 H1 C444\nFRAME\n\x20\x80\x80"), 19) << "not luma alone";
    EXPECT_EQ(greyOf("YUV4MPEG2 W1 H1 C444 XCOLORRANGE=FULL\nFRAME\n\x20\x80\x80"), 32);
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

}  // namespace
}  // namespace stx
