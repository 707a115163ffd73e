// Chunks that are made row by row of halves and floats.

#include <gtest/gtest.h>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>

#include <cmath>
#include <random>
#include <vector>

#include "formats/exr/exr_file.hpp"
#include "formats/exr/exr_zip.hpp"
#include "tests/temporary_folder.hpp"

namespace stx {
namespace {

/// A wide picture of level 1, as rendered ones are: OpenEXR reads it, and so do we.
TEST(ExrWriter, RowsOfHalvesAndFloatsAreReadByTheLibrary) {
    const TemporaryFolder folder;
    constexpr int kWidth = 900, kHeight = 40;
    constexpr std::size_t kCount = std::size_t{kWidth} * kHeight;
    std::vector<float> red(kCount), depth(kCount);
    std::mt19937 random(4);
    for (std::size_t i = 0; i < kCount; ++i) {
        const std::size_t x = i % kWidth;
        red[i] = x < 300 ? 0.0f : 0.5f + 0.4f * std::sin(static_cast<float>(x) * 0.01f);
        depth[i] = x < 300 ? INFINITY : 2.0f + 0.001f * static_cast<float>(random() % 1000);
    }
    std::vector<std::uint16_t> halves(kCount);
    exr::halvesFrom(red.data(), 1, halves);
    ExrPart part;
    part.width = part.displayWidth = kWidth;
    part.height = part.displayHeight = kHeight;
    part.zipLevel = 1;
    for (const char* name : {"R", "G", "albedo.R"})
        part.channels.push_back({name, ExrChannel::Type::half});
    part.channels.push_back({"Z", ExrChannel::Type::float32});
    const auto path = folder / "a.exr";
    const auto written = [&]() -> Result<void> {
        STX_TRY(auto file, OutputFile::create(path));
        STX_TRY(auto writer, ExrWriter::create(file, {part}));
        // The same from floats and as halves.
        STX_CHECK(writer.writePart(0, {{.channel = "G", .values = red.data()},
                                       {.channel = "R", .halves = halves.data()},
                                       {.channel = "albedo.R", .halves = halves.data()},
                                       {.channel = "Z", .values = depth.data()}}));
        STX_CHECK(writer.finish());
        return file.commit();
    }();
    ASSERT_TRUE(written) << written.error().text();

    const auto reader = ExrReader::open(path, Limits());
    ASSERT_TRUE(reader) << reader.error().text();
    std::vector<float> r(kCount), g(kCount), albedo(kCount), z(kCount), expected(kCount);
    exr::floatsFrom(halves, expected.data(), 1);
    const auto read = reader->readPart(0, {{"R", r.data(), 1},
                                           {"G", g.data(), 1},
                                           {"albedo.R", albedo.data(), 1},
                                           {"Z", z.data(), 1}});
    ASSERT_TRUE(read) << read.error().text();
    EXPECT_EQ(r, expected);
    EXPECT_EQ(g, expected);
    EXPECT_EQ(albedo, expected);
    EXPECT_EQ(z, depth);

    Imf::InputFile file(path.c_str());
    const Imath::Box2i window = file.header().dataWindow();
    std::vector<std::uint16_t> theirs(kCount);
    std::vector<float> theirDepth(kCount);
    Imf::FrameBuffer pixels;
    pixels.insert("albedo.R", Imf::Slice::Make(Imf::HALF, theirs.data(), window));
    pixels.insert("Z", Imf::Slice::Make(Imf::FLOAT, theirDepth.data(), window));
    file.setFrameBuffer(pixels);
    file.readPixels(0, kHeight - 1);
    EXPECT_EQ(theirs, halves);
    EXPECT_EQ(theirDepth, depth);
}

}  // namespace
}  // namespace stx
