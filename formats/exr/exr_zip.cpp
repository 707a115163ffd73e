#include "formats/exr/exr_zip.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <memory>

#include "formats/files/deflate.hpp"

namespace stx::exr {
namespace {

/// Without a branch, so that compilers make vectors of it.
inline std::uint32_t halfOf(float value) {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    const std::uint32_t sign = bits >> 16 & 0x8000u;
    const std::uint32_t size = bits & 0x7fffffffu;
    // From 2^-14 on: the exponent's bias changes by 112, and 13 bits are rounded away.
    const std::uint32_t normal = (size - (112u << 23) + 0xfffu + (size >> 13 & 1u)) >> 13;
    // Below: the sum with 1/2 rounds at a half's smallest step, 2^-24.
    const std::uint32_t denormal =
        std::bit_cast<std::uint32_t>(std::bit_cast<float>(size) + 0.5f) - (126u << 23);
    const std::uint32_t beyond = 0x7c00u | (size > 0x7f800000u) << 9;  // infinity, NaN
    const auto choose = [](bool first, std::uint32_t a, std::uint32_t b) {
        const std::uint32_t mask = 0u - first;
        return (a & mask) | (b & ~mask);
    };
    const std::uint32_t finite = choose(size < (113u << 23), denormal, normal);
    return sign | choose(size < (143u << 23), finite, beyond);
}

/// Even bytes, then odd ones, each less the one before.
void splitAndSubtract(std::span<const std::uint8_t> raw, std::uint8_t* to) {
    const std::size_t evens = (raw.size() + 1) / 2, odds = raw.size() / 2;
    const auto difference = [](int a, int b) { return static_cast<std::uint8_t>(a - b + 128); };
    to[0] = raw[0];
    const std::uint8_t* from = raw.data();
    for (std::size_t i = 1; i < evens; ++i) to[i] = difference(from[2 * i], from[2 * i - 2]);
    if (odds == 0) return;
    to += evens;
    to[0] = difference(from[1], from[2 * evens - 2]);
    for (std::size_t i = 1; i < odds; ++i) to[i] = difference(from[2 * i + 1], from[2 * i - 1]);
}

}  // namespace

void halvesFrom(const float* from, std::size_t stride, std::span<std::uint16_t> to) {
    constexpr std::size_t kPiece = 256;
    float piece[kPiece];
    for (std::size_t begin = 0; begin < to.size(); begin += kPiece) {
        const std::size_t count = std::min(kPiece, to.size() - begin);
        for (std::size_t i = 0; i < count; ++i) piece[i] = from[(begin + i) * stride];
        for (std::size_t i = 0; i < count; ++i)
            to[begin + i] = static_cast<std::uint16_t>(halfOf(piece[i]));
    }
}

Bytes zipChunk(std::span<const std::uint8_t> raw, int level) {
    const auto split = std::make_unique_for_overwrite<std::uint8_t[]>(raw.size());
    splitAndSubtract(raw, split.get());
    const std::span bytes(split.get(), raw.size());
    const auto packed = std::make_unique_for_overwrite<std::byte[]>(raw.size());
    // No room for as many bytes as there were: then it gives 0.
    const std::size_t size =
        compressZlib(std::as_bytes(bytes), level, {packed.get(), raw.size() - 1});
    const auto stored = size == 0 ? std::as_bytes(raw) : ByteSpan(packed.get(), size);
    return {stored.begin(), stored.end()};
}

}  // namespace stx::exr
