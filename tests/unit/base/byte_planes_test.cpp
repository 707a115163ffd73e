#include "lib/base/byte_planes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <random>
#include <vector>

#include "lib/base/rounding.hpp"

namespace stx {
namespace {

std::vector<std::uint8_t> someBytes(std::size_t count, unsigned seed) {
    std::mt19937 random(seed);
    std::vector<std::uint8_t> out(count);
    // Ends of the range are where eight bits overflow.
    for (auto& b : out) {
        const auto v = random();
        b = static_cast<std::uint8_t>(v % 4 == 0 ? 0 : v % 4 == 1 ? 255 : v >> 8);
    }
    return out;
}

TEST(BytePlanes, WhatIsSplitIsJoinedAgain) {
    std::mt19937 random(2);
    for (std::size_t size = 1; size < 100; ++size) {
        std::vector<std::uint8_t> raw(size), split(size), joined(size);
        for (auto& byte : raw) byte = static_cast<std::uint8_t>(random());
        splitAndSubtract(raw, split.data());
        addAndJoin(split.data(), joined);
        EXPECT_EQ(joined, raw) << size;
    }
}

TEST(BytePlanes, WordsInPiecesGiveWhatAllBytesGive) {
    for (const std::size_t words : {1u, 2u, 3u, 17u, 400u}) {
        const auto raw = someBytes(2 * words, static_cast<unsigned>(words));
        std::vector<std::uint8_t> expected(raw.size()), split(raw.size());
        splitAndSubtract(raw, expected.data());
        std::vector<std::uint16_t> all(words);
        std::memcpy(all.data(), raw.data(), raw.size());
        std::uint16_t before = 128;
        for (std::size_t first = 0; first < words;) {
            const std::size_t count = std::min<std::size_t>(1 + first % 7, words - first);
            splitAndSubtract(std::span(all).subspan(first, count), before, split.data() + first,
                             split.data() + words + first);
            first += count;
            before = all[first - 1];
        }
        // The first high byte follows the last low one.
        split[words] = static_cast<std::uint8_t>(split[words] - before);
        EXPECT_EQ(split, expected) << words;
        std::vector<std::uint8_t> back(raw.size());
        addAndJoin(split.data(), back);
        EXPECT_EQ(back, raw);
    }
}

TEST(Rounding, IsThatOfTheLibrary) {
    for (const float v :
         {0.0f, 0.49999997f, 0.5f, 0.50000006f, 1.5f, 2.5f, 126.5f, 8388607.5f, 3e7f})
        for (const float s : {v, -v})
            EXPECT_EQ(roundToInt(s), static_cast<int>(std::round(s))) << s;
}

}  // namespace
}  // namespace stx
