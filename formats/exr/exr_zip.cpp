#include "formats/exr/exr_zip.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <memory>

#include "formats/files/deflate.hpp"
#include "lib/base/byte_planes.hpp"

namespace stx::exr {
namespace {

/// Without a branch, so that compilers make vectors of it. The product moves the exponent's bias,
/// of denormal halves as well.
inline float floatOf(std::uint16_t half) {
    const std::uint32_t size = (half & 0x7fffu) << 13;
    const float scaled = std::bit_cast<float>(size) * 0x1p112f;
    const std::uint32_t beyond = size >= 0x0f800000u ? 0x7f800000u : 0u;  // infinity, NaN
    return std::bit_cast<float>((half & 0x8000u) << 16 | std::bit_cast<std::uint32_t>(scaled) |
                                beyond);
}

/// The inverse, likewise. Sizes have no sign, so they are signed numbers, which more processors
/// compare.
inline std::uint16_t halfOf(float value) {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    const auto size = static_cast<std::int32_t>(bits & 0x7fffffffu);
    // From 2^-14 on: the exponent's bias changes by 112, and 13 bits are rounded away.
    const std::int32_t normal = (size + (0xfff - (112 << 23)) + (size >> 13 & 1)) >> 13;
    // Below: the sum with 1/2 rounds at a half's smallest step, 2^-24.
    const std::int32_t denormal =
        std::bit_cast<std::int32_t>(std::bit_cast<float>(size) + 0.5f) - (126 << 23);
    const std::int32_t beyond = size > 0x7f800000 ? 0x7e00 : 0x7c00;  // NaN, infinity
    // All bits set where it is so: a choice by `?` would become a branch around the sum above.
    const std::int32_t large = -(size >= 143 << 23), small = -(size < 113 << 23);
    const std::int32_t finite = (denormal & small) | (normal & ~small);
    return static_cast<std::uint16_t>(
        (bits >> 16 & 0x8000u) | static_cast<std::uint32_t>((beyond & large) | (finite & ~large)));
}

}  // namespace

void halvesFrom(const float* from, std::size_t stride, std::span<std::uint16_t> to) {
    constexpr std::size_t kPiece = 256;
    float piece[kPiece];
    for (std::size_t begin = 0; begin < to.size(); begin += kPiece) {
        const std::size_t count = std::min(kPiece, to.size() - begin);
        const float* values = stride == 1 ? from + begin : piece;
        for (std::size_t i = 0; stride != 1 && i < count; ++i)
            piece[i] = from[(begin + i) * stride];
        for (std::size_t i = 0; i < count; ++i) to[begin + i] = halfOf(values[i]);
    }
}

Bytes zipChunk(std::span<std::uint8_t> split, int level) {
    const auto packed = std::make_unique_for_overwrite<std::uint8_t[]>(split.size());
    // No room for as many bytes as there were: then it gives 0.
    const std::size_t size =
        compressZlib(std::as_bytes(split), level,
                     std::as_writable_bytes(std::span(packed.get(), split.size() - 1)));
    const std::span to(packed.get(), size > 0 ? size : split.size());
    if (size == 0) addAndJoin(split.data(), to);
    const auto stored = std::as_bytes(to);
    return {stored.begin(), stored.end()};
}

void floatsFrom(std::span<const std::uint16_t> halves, float* to, std::size_t stride) {
    constexpr std::size_t kPiece = 256;
    float piece[kPiece];
    for (std::size_t begin = 0; begin < halves.size(); begin += kPiece) {
        const std::size_t count = std::min(kPiece, halves.size() - begin);
        for (std::size_t i = 0; i < count; ++i) piece[i] = floatOf(halves[begin + i]);
        for (std::size_t i = 0; i < count; ++i) to[(begin + i) * stride] = piece[i];
    }
}

bool unzipChunk(ByteSpan stored, std::span<std::uint8_t> raw) {
    if (stored.size() == raw.size()) {
        std::memcpy(raw.data(), stored.data(), raw.size());
        return true;
    }
    const auto split = std::make_unique_for_overwrite<std::uint8_t[]>(raw.size());
    if (!inflateZlib(stored, std::as_writable_bytes(std::span(split.get(), raw.size()))))
        return false;
    addAndJoin(split.get(), raw);
    return true;
}

}  // namespace stx::exr
