// Chunks that hold fewer pixels than they should: OpenEXR takes what its memory held for them.

#include <gtest/gtest.h>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfTileDescription.h>
#include <OpenEXR/ImfTiledOutputFile.h>

#include <cstring>
#include <string>
#include <vector>

#include "formats/exr/exr_file.hpp"
#include "formats/files/deflate.hpp"
#include "tests/temporary_folder.hpp"

namespace stx {
namespace {

constexpr int kDamagedWidth = 150, kDamagedHeight = 70;
constexpr std::size_t kDamagedCount = std::size_t{kDamagedWidth} * kDamagedHeight;
constexpr Imf::Compression kAll[] = {
    Imf::NO_COMPRESSION,   Imf::RLE_COMPRESSION,   Imf::ZIPS_COMPRESSION, Imf::ZIP_COMPRESSION,
    Imf::PIZ_COMPRESSION,  Imf::PXR24_COMPRESSION, Imf::B44_COMPRESSION,  Imf::B44A_COMPRESSION,
    Imf::DWAA_COMPRESSION, Imf::DWAB_COMPRESSION};

enum class Shape { lines, tiles, mipmap, ripmap };
constexpr Shape kShapes[] = {Shape::lines, Shape::tiles, Shape::mipmap, Shape::ripmap};

/// A smooth picture of halves, floats, integers and alpha, the window of which begins below 0.
Bytes exrOf(Imf::Compression compression, Shape shape) {
    const Imath::Box2i window({-3, -5}, {kDamagedWidth - 4, kDamagedHeight - 6});
    Imf::Header header(window, window);
    header.compression() = compression;
    header.channels().insert("R", Imf::Channel(Imf::HALF));
    header.channels().insert("A", Imf::Channel(Imf::HALF));
    header.channels().insert("Z", Imf::Channel(Imf::FLOAT));
    header.channels().insert("id", Imf::Channel(Imf::UINT));
    std::vector<float> values(kDamagedCount);
    for (std::size_t i = 0; i < kDamagedCount; ++i)
        values[i] = static_cast<float>(i % kDamagedWidth) / 256.0f;
    std::vector<std::uint16_t> halves(kDamagedCount, 0x3c00);
    std::vector<std::uint32_t> ids(kDamagedCount, 7);
    Imf::FrameBuffer pixels;
    pixels.insert("R", Imf::Slice::Make(Imf::HALF, halves.data(), window));
    pixels.insert("A", Imf::Slice::Make(Imf::HALF, halves.data(), window));
    pixels.insert("Z", Imf::Slice::Make(Imf::FLOAT, values.data(), window));
    pixels.insert("id", Imf::Slice::Make(Imf::UINT, ids.data(), window));
    const TemporaryFolder folder;
    const auto path = folder / "a.exr";
    if (shape == Shape::lines) {
        Imf::OutputFile file(path.c_str(), header);
        file.setFrameBuffer(pixels);
        file.writePixels(kDamagedHeight);
    } else {
        header.setTileDescription({64, 32,
                                   shape == Shape::tiles    ? Imf::ONE_LEVEL
                                   : shape == Shape::mipmap ? Imf::MIPMAP_LEVELS
                                                            : Imf::RIPMAP_LEVELS,
                                   Imf::ROUND_UP});
        Imf::TiledOutputFile file(path.c_str(), header);
        file.setFrameBuffer(pixels);
        for (int y = 0; y < file.numYLevels(); ++y) {
            for (int x = 0; x < file.numXLevels(); ++x) {
                if (file.isValidLevel(x, y))
                    file.writeTiles(0, file.numXTiles(x) - 1, 0, file.numYTiles(y) - 1, x, y);
            }
        }
    }
    return readFile(path, Limits()).value();
}

Result<void> readAll(const Bytes& bytes) {
    STX_TRY(const auto reader, ExrReader::open(bytes, "a.exr", Limits()));
    std::vector<float> r(kDamagedCount), a(kDamagedCount), z(kDamagedCount), id(kDamagedCount);
    return reader.readPart(0,
                           {{"R", r.data()}, {"A", a.data()}, {"Z", z.data()}, {"id", id.data()}});
}

/// Where the bytes of chunk `index` begin, behind their size.
std::size_t chunkAt(const Bytes& bytes, std::size_t index, Shape shape) {
    const auto parts = exrChunksOfParts(
        [&](std::uint64_t offset, void* to, std::size_t size) {
            if (offset > bytes.size() || size > bytes.size() - offset) return false;
            std::memcpy(to, bytes.data() + offset, size);
            return true;
        },
        bytes.size());
    return static_cast<std::size_t>(parts.at(0).offsets.at(index)) +
           (shape == Shape::lines ? 8 : 20);
}

std::int32_t sizeAt(const Bytes& bytes, std::size_t data) {
    std::int32_t size = 0;
    std::memcpy(&size, bytes.data() + data - 4, 4);
    return size;
}

void setSize(Bytes& bytes, std::size_t data, std::int32_t size) {
    std::memcpy(bytes.data() + data - 4, &size, 4);
}

std::size_t firstLevelChunks(Imf::Compression compression, Shape shape) {
    if (shape != Shape::lines) return 3 * 3;
    const int lines = compression == Imf::DWAB_COMPRESSION   ? 256
                      : compression <= Imf::ZIPS_COMPRESSION ? 1
                      : compression == Imf::ZIP_COMPRESSION || compression == Imf::PXR24_COMPRESSION
                          ? 16
                          : 32;
    return static_cast<std::size_t>((kDamagedHeight + lines - 1) / lines);
}

TEST(ExrDamage, WholeFilesOfEachKindAreRead) {
    for (const auto shape : kShapes) {
        for (const auto compression : kAll) {
            const auto ok = readAll(exrOf(compression, shape));
            EXPECT_TRUE(ok) << compression << ": " << ok.error().text();
        }
    }
}

TEST(ExrDamage, AnEmptyChunkIsAnError) {
    for (const auto shape : kShapes) {
        for (const auto compression : kAll) {
            for (const bool last : {false, true}) {
                Bytes bytes = exrOf(compression, shape);
                const std::size_t chunk = last ? firstLevelChunks(compression, shape) - 1 : 0;
                setSize(bytes, chunkAt(bytes, chunk, shape), 0);
                const auto ok = readAll(bytes);
                ASSERT_FALSE(ok) << "compression " << compression << ", chunk " << chunk;
                EXPECT_EQ(ok.error().code, ErrorCode::invalidInput);
            }
        }
    }
}

/// A whole stream of fewer bytes than the pixels take, in the place of a chunk.
TEST(ExrDamage, AChunkThatUnpacksToTooFewBytesIsAnError) {
    for (const auto shape : kShapes) {
        for (const auto compression :
             {Imf::ZIPS_COMPRESSION, Imf::ZIP_COMPRESSION, Imf::PXR24_COMPRESSION}) {
            Bytes bytes = exrOf(compression, shape);
            const std::size_t data = chunkAt(bytes, 0, shape);
            const std::vector<std::byte> few(100, std::byte{1});
            std::vector<std::byte> packed(zlibBound(few.size()));
            packed.resize(compressZlib(few, 6, packed));
            ASSERT_LE(packed.size(), static_cast<std::size_t>(sizeAt(bytes, data)));
            std::copy(packed.begin(), packed.end(),
                      bytes.begin() + static_cast<std::ptrdiff_t>(data));
            setSize(bytes, data, static_cast<std::int32_t>(packed.size()));
            const auto ok = readAll(bytes);
            ASSERT_FALSE(ok) << "compression " << compression;
            EXPECT_NE(ok.error().text().find("does not hold all of its pixels"), std::string::npos)
                << ok.error().text();
        }
    }
}

TEST(ExrDamage, AChunkThatIsCutShortIsAnError) {
    for (const auto shape : kShapes) {
        for (const auto compression : kAll) {
            Bytes bytes = exrOf(compression, shape);
            const std::size_t data = chunkAt(bytes, 0, shape);
            for (const std::int32_t size : {sizeAt(bytes, data) / 2, 1}) {
                setSize(bytes, data, size);
                EXPECT_FALSE(readAll(bytes)) << "compression " << compression << ", " << size;
            }
        }
    }
}

/// The sizes in the header of a chunk of DWA: none of them may be smaller.
TEST(ExrDamage, ADwaChunkWhoseHeaderClaimsLessIsAnError) {
    for (const auto compression : {Imf::DWAA_COMPRESSION, Imf::DWAB_COMPRESSION}) {
        const Bytes whole = exrOf(compression, Shape::lines);
        const std::size_t data = chunkAt(whole, 0, Shape::lines);
        ASSERT_GT(sizeAt(whole, data), 88);
        for (std::size_t field = 1; field < 10; ++field) {
            Bytes bytes = whole;
            std::memset(bytes.data() + data + field * 8, 0, 8);
            EXPECT_FALSE(readAll(bytes)) << "field " << field;
        }
    }
}

}  // namespace
}  // namespace stx
