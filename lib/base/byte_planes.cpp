#include "lib/base/byte_planes.hpp"

#include <cstddef>

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

}  // namespace stx
