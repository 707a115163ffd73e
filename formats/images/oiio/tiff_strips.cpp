#include "formats/images/oiio/tiff_strips.hpp"

#include <fmt/format.h>
#include <libdeflate.h>
#include <tiffio.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <memory>

namespace stx::codecs {
namespace {

struct Memory {
    std::span<const std::byte> bytes;
    std::uint64_t at = 0;
};

struct CloseTiff {
    void operator()(TIFF* file) const { TIFFClose(file); }
};

Memory& memoryOf(thandle_t handle) {
    return *static_cast<Memory*>(handle);
}

std::unique_ptr<TIFF, CloseTiff> openIn(Memory& memory) {
    return std::unique_ptr<TIFF, CloseTiff>(TIFFClientOpen(
        "image.tif", "rm", &memory,
        [](thandle_t handle, void* to, tmsize_t size) -> tmsize_t {
            Memory& m = memoryOf(handle);
            const std::uint64_t from = std::min<std::uint64_t>(m.at, m.bytes.size());
            const auto count = std::min(static_cast<std::uint64_t>(size), m.bytes.size() - from);
            std::memcpy(to, m.bytes.data() + from, count);
            m.at = from + count;
            return static_cast<tmsize_t>(count);
        },
        [](thandle_t, void*, tmsize_t) -> tmsize_t { return 0; },
        [](thandle_t handle, toff_t offset, int whence) -> toff_t {
            Memory& m = memoryOf(handle);
            m.at = offset + (whence == SEEK_CUR ? m.at : whence == SEEK_END ? m.bytes.size() : 0);
            return m.at;
        },
        [](thandle_t) { return 0; },
        [](thandle_t handle) -> toff_t { return memoryOf(handle).bytes.size(); }, nullptr,
        nullptr));
}

/// Bytes that a PackBits strip (TIFF 6.0, section 9) unpacks to, and that are left over when
/// `wanted` are there.
struct Unpacked {
    std::uint64_t size = 0, left = 0;
};
Unpacked unpackedSize(std::span<const std::byte> strip, std::uint64_t wanted) {
    Unpacked found;
    std::size_t at = 0;
    while (at < strip.size() && found.size < wanted) {
        const auto code = std::to_integer<std::uint8_t>(strip[at++]);
        if (code == 128) continue;  // nothing, as padding
        const std::size_t literal = code < 128 ? code + 1u : 1u;
        if (literal > strip.size() - at) break;
        found.size += code < 128 ? code + 1u : 257u - code;
        at += literal;
    }
    while (at < strip.size() && strip[at] == std::byte{128}) ++at;
    found.left = strip.size() - at;
    return found;
}

/// What is wrong with a strip or tile that holds `wanted` bytes of pixels, in at most `whole`.
std::string damageOf(std::span<const std::byte> packed, int compression, std::uint64_t wanted,
                     std::vector<std::byte>& whole, libdeflate_decompressor& inflate) {
    if (compression == COMPRESSION_PACKBITS) {
        const auto [size, left] = unpackedSize(packed, wanted);
        // A byte may make the next strip begin at an even place.
        if (size != wanted || left > 1)
            return fmt::format("unpacks to {} bytes in place of {}, with {} left over", size,
                               wanted, left);
        return {};
    }
    std::size_t size = 0;
    switch (libdeflate_zlib_decompress(&inflate, packed.data(), packed.size(), whole.data(),
                                       whole.size(), &size)) {
        case LIBDEFLATE_BAD_DATA:
            return "does not have the checksum that it names";
        case LIBDEFLATE_SUCCESS:
            if (size < wanted)
                return fmt::format("unpacks to {} bytes in place of {}", size, wanted);
            return {};
        default:  // rows below the picture
            return {};
    }
}

}  // namespace

std::string damageOfStrips(std::span<const std::byte> file, std::uint64_t end) {
    Memory memory{file};
    const auto tiff = openIn(memory);
    if (!tiff) return {};
    std::uint16_t compression = 0, order = FILLORDER_MSB2LSB, planar = PLANARCONFIG_CONTIG;
    std::uint32_t rows = 0, perStrip = 0;
    TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_COMPRESSION, &compression);
    TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_FILLORDER, &order);
    TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_PLANARCONFIG, &planar);
    TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_IMAGELENGTH, &rows);
    TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_ROWSPERSTRIP, &perStrip);
    const bool packBits = compression == COMPRESSION_PACKBITS;
    const bool deflate =
        compression == COMPRESSION_DEFLATE || compression == COMPRESSION_ADOBE_DEFLATE;
    const bool tiled = TIFFIsTiled(tiff.get()) != 0;
    perStrip = std::clamp<std::uint32_t>(perStrip, 1, std::max<std::uint32_t>(rows, 1));
    const std::uint32_t count =
        tiled ? TIFFNumberOfTiles(tiff.get()) : TIFFNumberOfStrips(tiff.get());
    const std::uint32_t inPlane = (rows + perStrip - 1) / perStrip;
    const auto most = static_cast<std::uint64_t>(tiled ? TIFFTileSize64(tiff.get())
                                                       : TIFFVStripSize64(tiff.get(), perStrip));
    const std::unique_ptr<libdeflate_decompressor, decltype(&libdeflate_free_decompressor)> inflate(
        libdeflate_alloc_decompressor(), &libdeflate_free_decompressor);
    if (!inflate) throw std::bad_alloc();
    std::vector<std::byte> whole(deflate ? most : 0);
    for (std::uint32_t i = 0; i < count; ++i) {
        const std::uint64_t from = TIFFGetStrileOffset(tiff.get(), i),
                            size = TIFFGetStrileByteCount(tiff.get(), i);
        // Sparse files have none for what is black.
        if (from == 0 && size == 0) continue;
        const std::uint32_t first =
            planar == PLANARCONFIG_SEPARATE && inPlane != 0 ? i % inPlane * perStrip : i * perStrip;
        const std::uint64_t wanted =
            tiled ? most
                  : TIFFVStripSize64(tiff.get(),
                                     std::min(perStrip, rows > first ? rows - first : 0u));
        const char* const name = tiled ? "tile" : "strip";
        // Some writers count too many bytes of what is not packed.
        const std::uint64_t needed =
            compression == COMPRESSION_NONE ? std::min(size, wanted) : size;
        if (from > end || needed > end - from)
            return fmt::format("{} {} lies past the end of the file", name, i);
        if (order != FILLORDER_MSB2LSB || !(packBits || deflate)) continue;
        const std::string damage =
            damageOf(file.subspan(from, size), compression, wanted, whole, *inflate);
        if (!damage.empty()) return fmt::format("{} {} {}", name, i, damage);
    }
    return {};
}

}  // namespace stx::codecs
