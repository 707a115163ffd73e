#include <atomic>

#include <gtest/gtest.h>

#include "lib/base/parallel_try.hpp"

namespace stx {
namespace {

TEST(Parallel, ShortBodiesRunOnceEach) {
    std::vector<int> times(1000, 0);
    parallelFor(3, 997, 16, [&](int i) { ++times[i]; });
    for (int i = 0; i < 1000; ++i) EXPECT_EQ(times[i], i >= 3 && i < 997 ? 1 : 0) << i;
}

TEST(Parallel, TheFirstErrorByNumberIsGivenWhenAllHaveRun) {
    std::atomic<int> ran = 0;
    const auto done = parallelTry(10, 40, [&](int i) -> Result<void> {
        ++ran;
        if (i % 8 == 7) return fail(ErrorCode::failed, "number {}", i);
        return {};
    });
    ASSERT_FALSE(done.has_value());
    EXPECT_EQ(done.error().message, "number 15");
    EXPECT_EQ(ran, 30);
    EXPECT_TRUE(parallelTry(5, 5, [](int) -> Result<void> {
                    return fail(ErrorCode::failed, "nothing");
                }).has_value());
}

}  // namespace
}  // namespace stx
