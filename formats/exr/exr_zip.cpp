#include "formats/exr/exr_zip.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <memory>

#include "formats/files/deflate.hpp"
#include "lib/base/halves.hpp"

namespace stx::exr {
namespace {

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

/// Without a branch, so that compilers make vectors of it. The product moves the exponent's bias,
/// of denormal halves as well.
inline float floatOf(std::uint16_t half) {
    const std::uint32_t size = (half & 0x7fffu) << 13;
    const float scaled = std::bit_cast<float>(size) * 0x1p112f;
    const std::uint32_t beyond = size >= 0x0f800000u ? 0x7f800000u : 0u;  // infinity, NaN
    return std::bit_cast<float>((half & 0x8000u) << 16 | std::bit_cast<std::uint32_t>(scaled) |
                                beyond);
}

/// The inverse of splitAndSubtract(); changes `split`.
void addAndJoin(std::uint8_t* split, std::span<std::uint8_t> raw) {
    const std::size_t evens = (raw.size() + 1) / 2, odds = raw.size() / 2;
    std::uint8_t last = split[0];
    for (std::size_t i = 1; i < raw.size(); ++i)
        split[i] = last = static_cast<std::uint8_t>(last + split[i] - 128);
    for (std::size_t i = 0; i < odds; ++i) {
        raw[2 * i] = split[i];
        raw[2 * i + 1] = split[evens + i];
    }
    if (evens > odds) raw[2 * odds] = split[odds];
}

}  // namespace

void halvesFrom(const float* from, std::size_t stride, std::span<std::uint16_t> to) {
    if (stride == 1) return stx::halvesFrom(from, to);
    constexpr std::size_t kPiece = 256;
    float piece[kPiece];
    for (std::size_t begin = 0; begin < to.size(); begin += kPiece) {
        const std::size_t count = std::min(kPiece, to.size() - begin);
        for (std::size_t i = 0; i < count; ++i) piece[i] = from[(begin + i) * stride];
        stx::halvesFrom(piece, to.subspan(begin, count));
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
