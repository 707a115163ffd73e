#include "lib/base/byte_planes.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace stx {
namespace {

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

}  // namespace
}  // namespace stx
