#include <gtest/gtest.h>

#include <Imath/half.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <random>

#include "formats/exr/exr_file.hpp"
#include "formats/exr/exr_zip.hpp"
#include "lib/base/parallel.hpp"
#include "tests/temporary_folder.hpp"

namespace stx {
namespace {

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
        const Bytes kept = exr::zipChunk(noise, level);
        ASSERT_EQ(kept.size(), noise.size());
        EXPECT_EQ(std::memcmp(kept.data(), noise.data(), noise.size()), 0);
        EXPECT_LT(exr::zipChunk(zeros, level).size(), 50u);
        EXPECT_EQ(exr::zipChunk(std::span(zeros).first(1), level).size(), 1u);
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
