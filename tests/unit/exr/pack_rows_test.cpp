#include "lib/base/pack_rows.hpp"

#include <gtest/gtest.h>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfInputFile.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "formats/exr/exr_file.hpp"
#include "formats/exr/exr_zip.hpp"
#include "formats/files/deflate.hpp"
#include "lib/base/deflate_blocks.hpp"
#include "tests/temporary_folder.hpp"

namespace stx {
namespace {

using Bytes8 = std::vector<std::uint8_t>;

/// The stream; checked to come back, and to touch no more than it may.
Bytes8 packed(const Bytes8& split, int rows, const std::vector<RowPart>& parts) {
    Bytes8 room(packedRoom(split.size()) + 64, 0xa5);
    const std::size_t size =
        packRows(split, rows, parts, adler32(std::as_bytes(std::span(split))), room.data());
    EXPECT_LE(size, packedRoom(split.size()));
    EXPECT_TRUE(std::all_of(room.end() - 64, room.end(), [](int b) { return b == 0xa5; }));
    room.resize(size);
    Bytes8 back(split.size());
    EXPECT_TRUE(
        inflateZlib(std::as_bytes(std::span(room)), std::as_writable_bytes(std::span(back))));
    EXPECT_EQ(back, split);
    return room;
}

/// Bytes of one kind each: even, in runs, skewed, noise, noise in the rows that are not looked at.
std::uint8_t byteOf(int kind, int row, std::size_t x, std::mt19937& random) {
    const auto v = random();
    switch (kind) {
        case 0:
            return 128;
        case 1:
            return static_cast<std::uint8_t>(x / 40 % 3 == 0 ? v : 128);
        case 2:
            return static_cast<std::uint8_t>(128 + (v % 8 == 0 ? v / 8 % 16 : v / 8 % 2));
        case 3:
            return static_cast<std::uint8_t>(v);
        default:
            return static_cast<std::uint8_t>(row % 4 == 0 ? v % 3 : v);
    }
}

Bytes8 chunkOf(int rows, const std::vector<RowPart>& parts, const std::vector<int>& kinds,
               unsigned seed) {
    std::mt19937 random(seed);
    Bytes8 out;
    for (int half = 0; half < 2; ++half) {
        for (int y = 0; y < rows; ++y) {
            std::vector<std::size_t> begins;
            for (std::size_t k = 0; k < parts.size(); ++k) {
                begins.push_back(out.size());
                for (std::size_t x = 0; x < parts[k].bytes; ++x) {
                    const bool copied = parts[k].same >= 0 && x > 0;
                    out.push_back(copied ? out[begins[static_cast<std::size_t>(parts[k].same)] + x]
                                         : byteOf(kinds[k], y, x, random));
                }
            }
        }
    }
    return out;
}

TEST(PackRows, ChunksOfAllKindsComeBack) {
    std::mt19937 random(1);
    for (unsigned seed = 0; seed < 200; ++seed) {
        const int rows = 1 + static_cast<int>(random() % 16);
        const auto width = static_cast<std::uint32_t>(1 + random() % (seed % 10 == 0 ? 5000 : 300));
        std::vector<RowPart> parts(1 + random() % 8);
        std::vector<int> kinds;
        for (std::size_t k = 0; k < parts.size(); ++k) {
            kinds.push_back(static_cast<int>(random() % 5));
            const bool wide = random() % 3 == 0;
            parts[k] = {wide ? 2 * width : width, wide ? 2u : 1u, -1};
            const std::size_t other = random() % parts.size();
            if (other < k && parts[other].same < 0 && parts[other].bytes == parts[k].bytes)
                parts[k].same = static_cast<int>(other);
        }
        packed(chunkOf(rows, parts, kinds, seed), rows, parts);
        if (HasFailure()) FAIL() << "seed " << seed;
    }
}

TEST(PackRows, WhatIsKnownTakesNothing) {
    const std::uint32_t width = 1000;
    const std::vector<RowPart> parts = {{width, 1, -1}, {width, 1, -1}, {width, 1, 1}};
    const std::size_t half = 16 * width;
    // Noise is stored, its copies and what is even take next to nothing, whichever comes first.
    const auto copies = packed(chunkOf(16, parts, {0, 3, 3}, 1), 16, parts);
    EXPECT_LT(copies.size(), 2 * half + half / 16);
    EXPECT_LT(packed(chunkOf(16, parts, {0, 0, 0}, 1), 16, parts).size(), 500u);
    // 1.5 bits a byte by its entropy of about 2.2, and its copies.
    const auto skewed = packed(chunkOf(16, parts, {0, 2, 2}, 1), 16, parts);
    EXPECT_LT(skewed.size(), half * 2 * 3 / 8);
    EXPECT_EQ(skewed, packed(chunkOf(16, parts, {0, 2, 2}, 1), 16, parts));
}

TEST(PackRows, CopiesTooFarBackAreWrittenAgain) {
    const std::uint32_t width = deflate::kWindow / 2 + 1;
    const std::vector<RowPart> parts = {{width, 1, -1}, {width, 1, 0}, {width, 1, 0}};
    const auto size = packed(chunkOf(2, parts, {3, 3, 3}, 1), 2, parts).size();
    EXPECT_GT(size, 2u * 2 * 2 * width);
    EXPECT_LT(size, 2u * 2 * 2 * width + width / 2);
}

TEST(DeflateBlocks, RepeatsOfAllSizesAndDistancesComeBack) {
    std::mt19937 random(2);
    Bytes8 bytes(deflate::kWindow);
    for (auto& b : bytes) b = static_cast<std::uint8_t>(random() % 7);
    deflate::Counts counts;
    for (int v = 0; v < 7; ++v) counts.symbols[static_cast<std::size_t>(v)] = 1u << (3 * v);
    std::vector<std::pair<std::uint32_t, std::uint32_t>> repeats;
    for (std::uint32_t size = 3; size < 800; ++size)
        repeats.emplace_back(size, 1 + static_cast<std::uint32_t>(random()) % deflate::kWindow);
    for (std::uint32_t distance = 1; distance <= deflate::kWindow; distance += distance / 3 + 1)
        for (const std::uint32_t near : {distance, deflate::kWindow + 1 - distance})
            repeats.emplace_back(3, near);
    for (const auto& [size, distance] : repeats) counts.addRepeat(size, distance, 1);
    const deflate::Codes own(counts);
    for (const auto* codes : {&own, &deflate::Codes::fixed()}) {
        Bytes8 expected = bytes;
        Bytes8 stream(1 << 20);
        deflate::BlockWriter out(stream.data());
        out.zlibHead();
        out.begin(*codes);
        out.literals(bytes);
        std::int64_t bits = codes->blockBits();
        for (const std::uint8_t byte : bytes) bits += codes->literalBits(byte);
        for (const auto& [size, distance] : repeats) {
            out.repeat(size, distance);
            bits += codes->repeatBits(size, distance);
            for (std::uint32_t i = 0; i < size; ++i)
                expected.push_back(expected[expected.size() - distance]);
        }
        out.end();
        const std::size_t size = out.finishZlib(adler32(std::as_bytes(std::span(expected))));
        // The header of two bytes, the last block's ten bits, the sum.
        EXPECT_EQ(size, static_cast<std::size_t>(2 + (bits + 10 + 7) / 8 + 4));
        Bytes8 back(expected.size());
        ASSERT_TRUE(inflateZlib(std::as_bytes(std::span(stream).first(size)),
                                std::as_writable_bytes(std::span(back))));
        EXPECT_EQ(back, expected);
    }
}

TEST(DeflateBlocks, LongWordsAreCut) {
    // Fibonacci's numbers give the longest words.
    deflate::Counts counts;
    std::uint32_t a = 1, b = 1;
    Bytes8 bytes;
    for (std::size_t v = 0; v < 40; ++v) {
        counts.symbols[v] = a;
        b += a;
        std::swap(a, b);
        for (int i = 0; i < 5; ++i) bytes.push_back(static_cast<std::uint8_t>(v));
    }
    const deflate::Codes codes(counts);
    for (int v = 0; v < 40; ++v) {
        EXPECT_GE(codes.literalBits(static_cast<std::uint8_t>(v)), 1);
        EXPECT_LE(codes.literalBits(static_cast<std::uint8_t>(v)), deflate::kLongestWord);
    }
    Bytes8 stream(4096), back(bytes.size());
    deflate::BlockWriter out(stream.data());
    out.zlibHead();
    out.begin(codes);
    out.literals(bytes);
    out.end();
    const std::size_t size = out.finishZlib(adler32(std::as_bytes(std::span(bytes))));
    ASSERT_TRUE(inflateZlib(std::as_bytes(std::span(stream).first(size)),
                            std::as_writable_bytes(std::span(back))));
    EXPECT_EQ(back, bytes);
}

/// A wide picture of level 1, as rendered ones are: OpenEXR reads what was packed, and so do we.
TEST(ExrWriter, PackedRowsAreReadByTheLibrary) {
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
