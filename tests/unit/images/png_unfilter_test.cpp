#include "formats/images/png_unfilter.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <random>
#include <vector>

namespace stx {
namespace {

/// Clause 9.2 as it says it.
void undo(std::vector<std::uint8_t>& rows, std::size_t count, std::size_t size, std::size_t step) {
    for (std::size_t y = 0; y < count; ++y) {
        std::uint8_t* row = rows.data() + y * (size + 1) + 1;
        for (std::size_t i = 0; i < size; ++i) {
            const int a = i >= step ? row[i - step] : 0;
            const int b = y > 0 ? row[i - (size + 1)] : 0;
            const int c = y > 0 && i >= step ? row[i - (size + 1) - step] : 0;
            const int p = a + b - c, pa = std::abs(p - a), pb = std::abs(p - b),
                      pc = std::abs(p - c);
            const int guess[] = {0, a, b, (a + b) / 2, pa <= pb && pa <= pc ? a : pb <= pc ? b : c};
            row[i] = static_cast<std::uint8_t>(row[i] + guess[row[-1]]);
        }
    }
}

TEST(PngUnfilter, EverySizeAndMixtureOfFiltersIsAsTheClauseSays) {
    std::mt19937 random(1);
    for (const int step : {1, 2, 3, 4, 6, 8}) {
        for (const std::size_t width : {1, 2, 3, 7, 16, 17, 40}) {
            for (const std::size_t count : {1, 2, 3, 8, 16, 17, 33}) {
                // All filters, Paeth alone, and bytes that are nearly alike or far apart.
                for (const int kind : {0, 1, 2}) {
                    const std::size_t size = width * static_cast<std::size_t>(step);
                    std::vector<std::uint8_t> rows(count * (size + 1) + kUnfilterSlack);
                    for (auto& byte : rows)
                        byte = static_cast<std::uint8_t>(
                            kind == 2 ? random() % 6 + random() % 2 * 250 : random());
                    for (std::size_t y = 0; y < count; ++y)
                        rows[y * (size + 1)] =
                            static_cast<std::uint8_t>(kind == 1 ? 4 : random() % 5);
                    auto expected = rows;
                    undo(expected, count, size, static_cast<std::size_t>(step));
                    std::size_t done = 0;
                    ASSERT_TRUE(
                        unfilterPng(rows, count, size, step, [&](std::size_t from, std::size_t to) {
                            EXPECT_EQ(from, done);
                            done = to;
                        }));
                    EXPECT_EQ(done, count);
                    rows.resize(count * (size + 1));
                    expected.resize(rows.size());
                    ASSERT_EQ(rows, expected)
                        << step << " bytes, " << width << "x" << count << ", kind " << kind;
                }
            }
        }
    }
}

TEST(PngUnfilter, FiltersAndStepsThatAreNotDefinedAreRefused) {
    const auto nothing = [](std::size_t, std::size_t) {};
    std::vector<std::uint8_t> rows(20 * 13 + kUnfilterSlack, 4);
    EXPECT_FALSE(unfilterPng(rows, 20, 12, 5, nothing));
    rows[17 * 13] = 5;
    EXPECT_FALSE(unfilterPng(rows, 20, 12, 4, nothing));
}

}  // namespace
}  // namespace stx
