#include <gtest/gtest.h>

#include <Imath/half.h>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfOutputFile.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <random>

#include "formats/exr/exr_file.hpp"
#include "formats/exr/exr_zip.hpp"
#include "lib/base/byte_planes.hpp"
#include "lib/base/parallel.hpp"
#include "tests/temporary_folder.hpp"

namespace stx {
namespace {

/// A chunk of these bytes as it is stored.
Bytes zipped(std::span<const std::uint8_t> raw, int level) {
    std::vector<std::uint8_t> split(raw.size());
    splitAndSubtract(raw, split.data());
    return exr::zipChunk(split, level);
}

TEST(ExrZip, HalvesAreThoseOfImath) {
    std::vector<float> values;
    for (std::uint32_t h = 0; h < 0x10000; ++h) {
        // Each half, what lies between it and the next, and their neighbours.
        const std::uint32_t exponent = h >> 10 & 31, mantissa = h & 1023;
        const auto bits =
            exponent == 0
                ? std::bit_cast<std::uint32_t>(std::ldexp(static_cast<float>(mantissa), -24))
                : (exponent + 112) << 23 | mantissa << 13;
        for (const int more : {-1, 0, 1, 0xfff, 0x1000, 0x1001})
            values.push_back(std::bit_cast<float>((bits + more) | (h & 0x8000u) << 16));
    }
    for (const float v : {0.0f, -0.0f, 65519.0f, 65520.0f, 1e30f, -1e30f, INFINITY, -INFINITY})
        values.push_back(v);
    std::vector<std::uint16_t> halves(values.size());
    exr::halvesFrom(values.data(), 1, halves);
    for (std::size_t i = 0; i < values.size(); ++i) {
        if (std::isnan(values[i])) continue;
        ASSERT_EQ(halves[i], half(values[i]).bits()) << values[i];
    }
    const float nan = NAN;
    exr::halvesFrom(&nan, 1, std::span(halves).first(1));
    half back;
    back.setBits(halves[0]);
    EXPECT_TRUE(back.isNan());
    const float strided[] = {1, 2, 3, 4, 5};
    exr::halvesFrom(strided, 2, std::span(halves).first(3));
    EXPECT_EQ(halves[2], half(5.0f).bits());
}

TEST(ExrZip, BytesThatDoNotShrinkStayAsTheyAre) {
    std::mt19937 random(1);
    std::vector<std::uint8_t> noise(1000), zeros(1000);
    for (auto& b : noise) b = static_cast<std::uint8_t>(random());
    for (const int level : {1, 4}) {
        const Bytes kept = zipped(noise, level);
        ASSERT_EQ(kept.size(), noise.size());
        EXPECT_EQ(std::memcmp(kept.data(), noise.data(), noise.size()), 0);
        EXPECT_LT(zipped(zeros, level).size(), 50u);
        EXPECT_EQ(zipped(std::span(zeros).first(1), level).size(), 1u);
    }
}

/// A part of random floats and of a smooth half channel.
struct Sample {
    ExrPart part;
    std::vector<float> noise, smooth;

    Sample(int width, int height, const std::string& name) {
        part.name = name;
        part.width = width;
        part.height = height;
        part.displayWidth = 100;
        part.displayHeight = 90;
        part.originX = 3;
        part.originY = -2;
        part.channels = {{"Z", ExrChannel::Type::float32},
                         {"smooth", ExrChannel::Type::half},
                         {"a.name.of.more.than.thirty-one.characters", ExrChannel::Type::half}};
        std::mt19937 random(static_cast<unsigned>(width));
        for (int i = 0; i < width * height; ++i) {
            noise.push_back(std::bit_cast<float>(
                static_cast<std::uint32_t>(random() & 0x3fffffffu) + (1u << 23)));
            smooth.push_back(static_cast<float>(i % 512));
        }
    }
    [[nodiscard]] std::vector<ExrConstPixels> pixels() const {
        return {{"smooth", smooth.data(), 1},
                {"Z", noise.data(), 1},
                {"a.name.of.more.than.thirty-one.characters", smooth.data(), 1}};
    }
};

Result<void> writeSamples(const std::filesystem::path& path, const std::vector<Sample>& samples) {
    STX_TRY(auto file, OutputFile::create(path));
    std::vector<ExrPart> parts;
    for (const auto& s : samples) parts.push_back(s.part);
    STX_TRY(auto writer, ExrWriter::create(file, parts));
    for (std::size_t i = 0; i < samples.size(); ++i)
        STX_CHECK(writer.writePart(static_cast<int>(i), samples[i].pixels()));
    STX_CHECK(writer.finish());
    return file.commit();
}

TEST(ExrZip, FloatsAreThoseOfImath) {
    std::vector<std::uint16_t> halves(0x10000);
    for (std::uint32_t h = 0; h < halves.size(); ++h) halves[h] = static_cast<std::uint16_t>(h);
    std::vector<float> floats(2 * halves.size(), -7.0f);
    exr::floatsFrom(halves, floats.data(), 2);
    for (std::uint32_t h = 0; h < halves.size(); ++h) {
        half expected;
        expected.setBits(halves[h]);
        ASSERT_EQ(std::bit_cast<std::uint32_t>(floats[2 * h]),
                  std::bit_cast<std::uint32_t>(static_cast<float>(expected)))
            << h;
        ASSERT_EQ(floats[2 * h + 1], -7.0f);
    }
}

TEST(ExrZip, ChunksComeBackAndDamageIsSeen) {
    std::mt19937 random(2);
    for (const std::size_t size : {1u, 2u, 3u, 1000u, 1001u}) {
        std::vector<std::uint8_t> raw(size), back(size);
        for (auto& b : raw) b = static_cast<std::uint8_t>(random() % 3);
        Bytes stored = zipped(raw, 4);
        ASSERT_TRUE(exr::unzipChunk(stored, back));
        EXPECT_EQ(back, raw);
        if (stored.size() == size) continue;
        std::vector<std::uint8_t> more(size + 1);
        EXPECT_FALSE(exr::unzipChunk(stored, more));
        stored.back() ^= std::byte{1};  // of the checksum
        EXPECT_FALSE(exr::unzipChunk(stored, back));
    }
}

/// What OpenEXR wrote, in each of its compressions, is read without it where that is possible: the
/// values are the same, lines in falling order, too.
TEST(ExrReader, FilesOfTheLibraryAreRead) {
    const TemporaryFolder folder;
    constexpr int kWidth = 37, kHeight = 51;
    std::vector<float> z;
    std::vector<half> r;
    std::mt19937 random(3);
    for (int i = 0; i < kWidth * kHeight; ++i) {
        z.push_back(i % 5 == 0 ? std::bit_cast<float>(static_cast<std::uint32_t>(random() >> 2))
                               : static_cast<float>(i));
        half value;
        value.setBits(static_cast<unsigned short>(i % 7 == 0 ? random() % 0x7c00 : i % 512));
        r.push_back(value);
    }
    for (const auto compression :
         {Imf::ZIP_COMPRESSION, Imf::ZIPS_COMPRESSION, Imf::PIZ_COMPRESSION, Imf::NO_COMPRESSION}) {
        for (const auto order : {Imf::INCREASING_Y, Imf::DECREASING_Y}) {
            const Imath::Box2i window({-3, 5}, {kWidth - 4, kHeight + 4});
            Imf::Header header(window, window, 1, Imath::V2f(0, 0), 1, order, compression);
            header.channels().insert("R", Imf::Channel(Imf::HALF));
            header.channels().insert("Z", Imf::Channel(Imf::FLOAT));
            const auto path = (folder / "a.exr").string();
            {
                Imf::OutputFile file(path.c_str(), header);
                Imf::FrameBuffer pixels;
                pixels.insert("R", Imf::Slice::Make(Imf::HALF, r.data(), window));
                pixels.insert("Z", Imf::Slice::Make(Imf::FLOAT, z.data(), window));
                file.setFrameBuffer(pixels);
                file.writePixels(kHeight);
            }
            const auto reader = ExrReader::open(path, Limits());
            ASSERT_TRUE(reader) << reader.error().text();
            std::vector<float> red(z.size()), depth(z.size()), none(z.size(), 1.0f);
            const auto read = reader->readPart(
                0, {{"R", red.data(), 1}, {"Z", depth.data(), 1}, {"no", none.data(), 1}});
            ASSERT_TRUE(read) << read.error().text();
            EXPECT_EQ(depth, z);
            for (std::size_t i = 0; i < r.size(); ++i)
                ASSERT_EQ(red[i], static_cast<float>(r[i])) << i;
            EXPECT_EQ(none, std::vector<float>(z.size(), 0.0f));
        }
    }
}

TEST(ExrWriter, PartsOfEachSizeComeBack) {
    const TemporaryFolder folder;
    const std::vector<Sample> all = {
        {1, 1, "one"}, {64, 90, "tall"}, {97, 16, "chunk"}, {5, 17, "rest"}};
    for (std::size_t count = 1; count <= all.size(); ++count) {
        const std::vector<Sample> samples(all.begin(),
                                          all.begin() + static_cast<std::ptrdiff_t>(count));
        const auto written = writeSamples(folder / "a.exr", samples);
        ASSERT_TRUE(written) << written.error().text();
        const auto reader = ExrReader::open(folder / "a.exr", Limits());
        ASSERT_TRUE(reader) << reader.error().text();
        ASSERT_EQ(reader->parts().size(), count);
        for (std::size_t i = 0; i < count; ++i) {
            const auto& s = samples[i];
            EXPECT_EQ(reader->parts()[i].originY, -2);
            EXPECT_EQ(reader->parts()[i].channels.size(), 3u);
            std::vector<float> noise(s.noise.size()), smooth(noise.size()), same(noise.size());
            const auto read =
                reader->readPart(static_cast<int>(i),
                                 {{"Z", noise.data(), 1},
                                  {"smooth", smooth.data(), 1},
                                  {"a.name.of.more.than.thirty-one.characters", same.data(), 1}});
            ASSERT_TRUE(read) << read.error().text();
            EXPECT_EQ(noise, s.noise);
            EXPECT_EQ(smooth, s.smooth);
            EXPECT_EQ(same, s.smooth);
        }
    }
}

TEST(ExrWriter, BytesDoNotDependOnThreads) {
    const TemporaryFolder folder;
    std::vector<Bytes> files;
    for (const int threads : {1, 2, 7}) {
        const ThreadLimit limit(threads);
        ASSERT_TRUE(writeSamples(folder / "a.exr", {{90, 80, "a"}, {30, 90, "b"}}));
        const auto bytes = readFile(folder / "a.exr", Limits());
        ASSERT_TRUE(bytes);
        files.push_back(*bytes);
    }
    EXPECT_EQ(files[0], files[1]);
    EXPECT_EQ(files[0], files[2]);
}

TEST(ExrWriter, PartsThatCannotBeAreRefused) {
    const TemporaryFolder folder;
    EXPECT_FALSE(writeSamples(folder / "a.exr", {{4, 4, "same"}, {4, 4, "same"}}));
    auto other = Sample(4, 4, "other");
    other.part.displayWidth = 7;
    EXPECT_FALSE(writeSamples(folder / "a.exr", {{4, 4, "same"}, other}));
    // A part, a channel that are forgotten.
    auto file = OutputFile::create(folder / "a.exr");
    ASSERT_TRUE(file);
    const Sample one(4, 4, "one"), two(4, 4, "two");
    auto writer = ExrWriter::create(*file, {one.part, two.part});
    ASSERT_TRUE(writer) << writer.error().text();
    auto pixels = one.pixels();
    ASSERT_TRUE(writer->writePart(0, pixels));
    const auto unfinished = writer->finish();
    ASSERT_FALSE(unfinished);
    EXPECT_NE(unfinished.error().text().find("part 1 was not written"), std::string::npos);
    pixels.pop_back();
    EXPECT_FALSE(writer->writePart(1, pixels));
    EXPECT_FALSE(std::filesystem::exists(folder / "a.exr"));
}

}  // namespace
}  // namespace stx
