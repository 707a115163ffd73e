#include "formats/files/deflate.hpp"

#include <libdeflate.h>
#ifdef STX_WITH_ISAL
#include <isa-l/crc.h>
#include <isa-l/igzip_lib.h>
#include <sys/mman.h>
#endif

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <memory>
#include <mutex>
#include <new>

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
/// States of ISA-L's compressor, kept for the next piece. Version 2.30 on x86 hashes bits 16 to 47
/// of its state's address where it means bytes 2 to 5 of a block of the data
/// (isal_deflate_icf_body_hash_hist, the first literal), so that where a state lies now and then
/// changes what is found: in up to one of 100 pictures. All of these lie where that hash is 0.
class States {
  public:
    static States& all() {
        static States states;
        return states;
    }
    /// All zeros. Throws std::bad_alloc.
    [[nodiscard]] isal_zstream& take() {
        const std::scoped_lock lock(mutex_);
        if (free_.empty()) {
            free_.reserve(++count_);  // so that give() need not
            free_.push_back(make());
        }
        isal_zstream& state = *free_.back();
        free_.pop_back();
        std::memset(&state, 0, sizeof state);
        return state;
    }
    void give(isal_zstream& state) noexcept {
        const std::scoped_lock lock(mutex_);
        free_.push_back(&state);
    }

  private:
    /// As many bits of the hash as any version's table of level 1 takes.
    static constexpr std::uint32_t kHash = 0x1fff;
    /// Bits 16 to 47 of where to look first: what is mapped without a wish lies above.
    static constexpr std::uint32_t kFirst = 0x7e900000;
    /// So often a place is found taken before any is good enough.
    static constexpr int kMostTaken = 100;

    isal_zstream* make() {
        for (int taken = 0; taken < kMostTaken; ++next_) {
            if ((crc32_iscsi(reinterpret_cast<unsigned char*>(&next_), sizeof next_, 0) & kHash) !=
                0)
                continue;
            const std::uintptr_t wanted = std::uintptr_t{next_} << 16;
            void* const at = map(reinterpret_cast<void*>(wanted));
            if (reinterpret_cast<std::uintptr_t>(at) >> 16 == next_) {
                ++next_;
                return static_cast<isal_zstream*>(at);
            }
            ::munmap(at, sizeof(isal_zstream));
            ++taken;
        }
        return static_cast<isal_zstream*>(map(nullptr));
    }
    static void* map(void* wish) {
        void* const at = ::mmap(wish, sizeof(isal_zstream), PROT_READ | PROT_WRITE,
                                MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        if (at == MAP_FAILED) throw std::bad_alloc();
        return at;
    }

    std::mutex mutex_;
    std::vector<isal_zstream*> free_;
    std::size_t count_ = 0;
    std::uint32_t next_ = kFirst;
};

std::size_t compressFast(std::span<const std::byte> from, std::span<std::byte> to) {
    constexpr std::size_t kBuffer = ISAL_DEF_LVL1_DEFAULT;
    const auto buffer = std::make_unique<std::uint8_t[]>(kBuffer);
    const auto give = [](isal_zstream* state) { States::all().give(*state); };
    const std::unique_ptr<isal_zstream, decltype(give)> state(&States::all().take());
    // Zeros: isal_deflate_stateless_init() of version 2.30 leaves hist_bits as it is, and what was
    // there would choose how far matches look back, and so the bytes.
    isal_zstream& stream = *state;
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
