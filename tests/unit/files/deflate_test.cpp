#include "formats/files/deflate.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdint>
#include <memory>
#include <thread>
#include <vector>

namespace stx {
namespace {

/// Leaves `word` all over what the next call's variables get of the stack.
[[gnu::noinline]] std::uint32_t fillStack(std::uint32_t word) {
    volatile std::uint32_t words[60000];
    for (auto& w : words) w = word;
    return words[word % 60000];
}

std::vector<std::byte> compressed(const std::vector<std::byte>& from, int level) {
    std::vector<std::byte> to(zlibBound(from.size()));
    to.resize(compressZlib(from, level, to));
    return to;
}

// ISA-L takes how far matches look back from a field that its own initialisation leaves unset.
TEST(Deflate, GivesTheSameBytesWhateverTheStackHeld) {
    std::vector<std::byte> from;
    for (std::uint32_t i = 0, x = 1; i < 50000; ++i) {
        x = x * 1664525 + 1013904223;
        from.push_back(static_cast<std::byte>(x >> 24 & (i / 500 % 2 == 0 ? 3 : 0x1f)));
    }
    for (const int level : {1, 4}) {
        const auto first = compressed(from, level);
        ASSERT_FALSE(first.empty());
        for (const std::uint32_t garbage : {0u, 1u, 3u, 9u, 12u, 0xffu}) {
            fillStack(garbage << 16 | garbage);
            EXPECT_EQ(compressed(from, level), first) << "level " << level << ", " << garbage;
        }
    }
}

// ISA-L takes a part of its state's address for data.
TEST(Deflate, GivesTheSameBytesWhereverMemoryIs) {
    std::vector<std::byte> from;
    for (std::uint32_t i = 0, x = 1; i < 1500; ++i) {
        x = x * 1664525 + 1013904223;
        from.push_back(static_cast<std::byte>(x >> 28));
    }
    from.insert(from.end(), from.begin(), from.end());
    const auto first = compressed(from, 1);
    // Rooms that are kept move the next ones on.
    std::vector<std::unique_ptr<std::byte[]>> kept;
    for (int i = 0; i < 15000; ++i) {
        kept.push_back(std::make_unique_for_overwrite<std::byte[]>(1 << 16));
        ASSERT_EQ(compressed(from, 1), first) << i;
    }
}

// The same, which shows once in 100 times where so many bytes are 0.
TEST(Deflate, GivesTheSameBytesOnManyThreads) {
    constexpr std::size_t kRow = 2801, kRows = 250;
    std::vector<std::byte> from(kRow * kRows);
    for (std::uint32_t y = 128, x = 1; y < kRows; ++y) {
        for (std::size_t i = 0; i < 8; ++i) {
            x = x * 1664525 + 1013904223;
            from[y * kRow + kRow / 2 + i] = static_cast<std::byte>(x >> 24);
        }
    }
    const auto first = compressed(from, 1);
    std::atomic<int> different = 0;
    std::vector<std::thread> threads;
    for (int k = 0; k < 8; ++k) {
        threads.emplace_back([&] {
            // Rooms that are kept move the next ones on.
            std::vector<std::unique_ptr<std::byte[]>> kept;
            for (int i = 0; i < 300; ++i) {
                kept.push_back(std::make_unique_for_overwrite<std::byte[]>(1 << 16));
                if (compressed(from, 1) != first) ++different;
            }
        });
    }
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(different, 0);
}

}  // namespace
}  // namespace stx
