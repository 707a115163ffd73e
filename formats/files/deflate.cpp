#include "formats/files/deflate.hpp"

#include <libdeflate.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <memory>
#include <new>
#ifdef STX_WITH_ISAL
#include <isa-l/crc.h>
#include <isa-l/igzip_lib.h>
#endif

namespace stx {
namespace {

struct FreeCompressor {
    void operator()(libdeflate_compressor* c) const { libdeflate_free_compressor(c); }
};
using Compressor = std::unique_ptr<libdeflate_compressor, FreeCompressor>;
struct FreeDecompressor {
    void operator()(libdeflate_decompressor* d) const { libdeflate_free_decompressor(d); }
};
using Decompressor = std::unique_ptr<libdeflate_decompressor, FreeDecompressor>;

#ifdef STX_WITH_ISAL
/// Where the compressor's state may lie in its room: in one of four blocks of 64 KiB.
constexpr std::size_t kBlock = 1 << 16, kBlocks = 4;

/// The bucket of igzip's table of level 1 for four bytes: their CRC-32C, 12 bits of it.
std::uint32_t bucketOf(const void* fourBytes) {
    unsigned char bytes[4];
    std::memcpy(bytes, fourBytes, sizeof bytes);
    return crc32_iscsi(bytes, sizeof bytes, 0) & 0xfff;
}

/// The block for which the result is the same at every address. Version 2.30 on x86 hashes bits 16
/// to 47 of its state's address where it means bytes 2 to 5 of the data, and so writes over some
/// bucket (isal_deflate_icf_body_hash_hist, the first literal). That changes what is found where it
/// is the bucket of the bytes from 0, 1 or 2 on: once in 1,400 times at most.
std::size_t harmlessBlock(std::span<const std::byte> from, const std::uint8_t* room) {
    std::size_t block = 0;
    const auto harms = [&] {
        const auto address = reinterpret_cast<std::uintptr_t>(room + block * kBlock);
        const auto hashed = static_cast<std::uint32_t>(address >> 16);
        const std::uint32_t bucket = bucketOf(&hashed);
        for (std::size_t at = 0; at < 3 && at + 4 <= from.size(); ++at)
            if (bucket == bucketOf(&from[at])) return true;
        return false;
    };
    while (block + 1 < kBlocks && harms()) ++block;
    return block;
}

std::size_t compressFast(std::span<const std::byte> from, std::span<std::byte> to) {
    constexpr std::size_t kBuffer = ISAL_DEF_LVL1_DEFAULT;
    const auto buffer = std::make_unique<std::uint8_t[]>(kBuffer);
    const auto room = std::make_unique_for_overwrite<std::uint8_t[]>(sizeof(isal_zstream) +
                                                                     (kBlocks - 1) * kBlock);
    static_assert(alignof(isal_zstream) <= alignof(std::max_align_t));
    // Zeros: isal_deflate_stateless_init() of version 2.30 leaves hist_bits as it is, and what was
    // there would choose how far matches look back, and so the bytes.
    isal_zstream& stream =
        *new (room.get() + harmlessBlock(from, room.get()) * kBlock) isal_zstream();
    isal_deflate_stateless_init(&stream);
    stream.hist_bits = 0;
    stream.level = 1;
    stream.level_buf = buffer.get();
    stream.level_buf_size = kBuffer;
    stream.gzip_flag = IGZIP_ZLIB;
    stream.end_of_stream = 1;
    // It only reads what its pointer could write.
    stream.next_in = reinterpret_cast<std::uint8_t*>(const_cast<std::byte*>(from.data()));
    stream.avail_in = static_cast<std::uint32_t>(from.size());
    stream.next_out = reinterpret_cast<std::uint8_t*>(to.data());
    stream.avail_out = static_cast<std::uint32_t>(std::min<std::size_t>(to.size(), UINT32_MAX));
    return isal_deflate_stateless(&stream) == COMP_OK ? stream.total_out : 0;
}
#endif

}  // namespace

std::size_t zlibBound(std::size_t size) {
    return libdeflate_zlib_compress_bound(nullptr, size);
}

std::size_t compressZlib(std::span<const std::byte> from, int level, std::span<std::byte> to) {
#ifdef STX_WITH_ISAL
    // It counts in 32 bits, the bytes of the result too.
    if (level == 1 && from.size() < (1u << 31)) return compressFast(from, to);
#endif
    const Compressor compressor(libdeflate_alloc_compressor(level));
    if (!compressor) throw std::bad_alloc();
    return libdeflate_zlib_compress(compressor.get(), from.data(), from.size(), to.data(),
                                    to.size());
}

bool inflateZlib(std::span<const std::byte> from, std::span<std::byte> to) {
    const Decompressor decompressor(libdeflate_alloc_decompressor());
    if (!decompressor) throw std::bad_alloc();
    return libdeflate_zlib_decompress(decompressor.get(), from.data(), from.size(), to.data(),
                                      to.size(), nullptr) == LIBDEFLATE_SUCCESS;
}

std::vector<std::byte> compressGzip(std::span<const std::byte> from, int level) {
    const Compressor compressor(libdeflate_alloc_compressor(level));
    if (!compressor) throw std::bad_alloc();
    std::vector<std::byte> to(libdeflate_gzip_compress_bound(compressor.get(), from.size()));
    to.resize(
        libdeflate_gzip_compress(compressor.get(), from.data(), from.size(), to.data(), to.size()));
    return to;
}

bool isGzip(std::span<const std::byte> bytes) {
    return bytes.size() > 2 && bytes[0] == std::byte{0x1f} && bytes[1] == std::byte{0x8b};
}

Result<std::vector<std::byte>> gunzip(std::span<const std::byte> from, const Limits& limits) {
    const Decompressor decompressor(libdeflate_alloc_decompressor());
    if (!decompressor) throw std::bad_alloc();
    std::vector<std::byte> out;
    std::size_t done = 0;
    while (!from.empty()) {
        // Most of what is packed is text, of which a fifth is left.
        std::size_t room = from.size() * 5 + 4096;
        std::size_t taken = 0, given = 0;
        auto result = LIBDEFLATE_INSUFFICIENT_SPACE;
        for (; result == LIBDEFLATE_INSUFFICIENT_SPACE; room *= 2) {
            if (!limits.checkAllocation(done + room, 1, "the unpacked file"))
                room = limits.maxMemoryBytes > done ? limits.maxMemoryBytes - done : 0;
            out.resize(done + room);
            result = libdeflate_gzip_decompress_ex(decompressor.get(), from.data(), from.size(),
                                                   out.data() + done, room, &taken, &given);
            if (result == LIBDEFLATE_INSUFFICIENT_SPACE)
                STX_CHECK(limits.checkAllocation(done + room + 1, 1, "the unpacked file"));
        }
        if (result != LIBDEFLATE_SUCCESS)
            return fail(ErrorCode::invalidInput, "the gzip file is damaged or cut short");
        done += given;
        from = from.subspan(taken);
    }
    out.resize(done);
    return out;
}

}  // namespace stx
