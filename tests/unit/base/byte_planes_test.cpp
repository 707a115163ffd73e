#include "lib/base/byte_planes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <random>
#include <vector>

#include "lib/base/halves.hpp"
#include "lib/base/paeth.hpp"
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

/// Clause 9.4 of PNG, word by word.
int paethPredictor(int left, int above, int corner) {
    const int p = left + above - corner;
    const int toLeft = std::abs(p - left), toAbove = std::abs(p - above),
              toCorner = std::abs(p - corner);
    if (toLeft <= toAbove && toLeft <= toCorner) return left;
    return toAbove <= toCorner ? above : corner;
}

TEST(BytePlanes, PaethIsThatOfTheStandard) {
    for (const std::size_t step : {1u, 2u, 3u, 4u, 6u, 8u}) {
        for (std::size_t size = 1; size < 300; size += size < 140 ? 1 : 37) {
            const auto row = someBytes(step + size, static_cast<unsigned>(size));
            const auto above = someBytes(step + size, static_cast<unsigned>(size + 1000));
            std::vector<std::uint8_t> out(size + 1, 77), expected(size + 1, 77);
            for (std::size_t i = 0; i < size; ++i)
                expected[i] = static_cast<std::uint8_t>(
                    row[step + i] - paethPredictor(row[i], above[step + i], above[i]));
            subtractPaeth(row.data() + step, above.data() + step, size, step, out.data());
            ASSERT_EQ(out, expected) << size << " bytes, step " << step;
        }
    }
}

TEST(BytePlanes, PlanesOfHalvesAreTheHalves) {
    std::mt19937 random(5);
    for (const int values : {3, 4}) {
        for (const std::size_t count : {1u, 15u, 16u, 17u, 100u}) {
            std::vector<float> from(count * static_cast<std::size_t>(values));
            for (auto& v : from)
                v = std::bit_cast<float>(static_cast<std::uint32_t>(random()) >> 2);
            std::vector<std::vector<std::uint16_t>> planes(4, std::vector<std::uint16_t>(count, 9));
            std::uint16_t* to[4] = {planes[0].data(), planes[1].data(), planes[2].data(),
                                    planes[3].data()};
            halfPlanes(from.data(), values, count, to);
            std::vector<std::uint16_t> expected(from.size());
            halvesFrom(from.data(), expected);
            for (std::size_t i = 0; i < from.size(); ++i)
                ASSERT_EQ(planes[i % static_cast<std::size_t>(values)]
                                [i / static_cast<std::size_t>(values)],
                          expected[i]);
            if (values == 3) {
                EXPECT_EQ(planes[3], std::vector<std::uint16_t>(count, 9));
            }
        }
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
