#include "lib/base/byte_planes.hpp"

#include <bit>
#include <cstddef>
#include <cstring>

namespace stx {

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

namespace {

/// Eight differences, as splitAndSubtract() makes them, become values, `last` being the one before.
std::uint64_t sumsOfEight(std::uint64_t differences, std::uint8_t last) {
    constexpr std::uint64_t kEvens = 0x00ff00ff00ff00ff, kFours = 0x0001000100010001;
    // In lanes of 16 bits, so that no sum reaches the next.
    const std::uint64_t centred = differences ^ 0x8080808080808080;  // less 128
    const std::uint64_t odd = centred >> 8 & kEvens, pairs = (centred & kEvens) + odd;
    const std::uint64_t upTo = (pairs + last) * kFours;
    return ((upTo - odd) & kEvens) | (upTo & kEvens) << 8;
}

}  // namespace

void splitAndSubtract(std::span<const std::uint16_t> words, std::uint16_t before, std::uint8_t* low,
                      std::uint8_t* high) {
    if (words.empty()) return;
    const auto first = [](unsigned a, unsigned b) {
        return static_cast<std::uint8_t>(a - b + 128);
    };
    const auto second = [](unsigned a, unsigned b) {
        return static_cast<std::uint8_t>((a >> 8) - (b >> 8) + 128);
    };
    low[0] = first(words[0], before);
    high[0] = second(words[0], before);
    const std::uint16_t* from = words.data();
    for (std::size_t i = 1; i < words.size(); ++i) {
        low[i] = first(from[i], from[i - 1]);
        high[i] = second(from[i], from[i - 1]);
    }
}

void addAndJoin(std::uint8_t* split, std::span<std::uint8_t> raw) {
    const std::size_t evens = (raw.size() + 1) / 2, odds = raw.size() / 2;
    std::uint8_t last = split[0];
    std::size_t at = 1;
    if constexpr (std::endian::native == std::endian::little) {
        for (; at + 8 <= raw.size(); at += 8) {
            std::uint64_t eight = 0;
            std::memcpy(&eight, split + at, 8);
            eight = sumsOfEight(eight, last);
            std::memcpy(split + at, &eight, 8);
            last = static_cast<std::uint8_t>(eight >> 56);
        }
    }
    for (; at < raw.size(); ++at)
        split[at] = last = static_cast<std::uint8_t>(last + split[at] - 128);
    for (std::size_t i = 0; i < odds; ++i) {
        raw[2 * i] = split[i];
        raw[2 * i + 1] = split[evens + i];
    }
    if (evens > odds) raw[2 * odds] = split[odds];
}

}  // namespace stx
