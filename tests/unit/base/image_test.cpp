#include "lib/base/image.hpp"

#include <gtest/gtest.h>

#include "lib/model/texture.hpp"

namespace stx {
namespace {

TEST(Image, WhatIsMovedFromIsEmpty) {
    Image<float> from(3, 2, 1.0f);
    Image<float> to = std::move(from);
    EXPECT_EQ(from, Image<float>());  // NOLINT(bugprone-use-after-move): that is the test
    EXPECT_EQ(to.size(), glm::ivec2(3, 2));
    from = std::move(to);
    EXPECT_TRUE(to.empty());  // NOLINT(bugprone-use-after-move)
    EXPECT_EQ(to.width(), 0);
    EXPECT_EQ(from.count(), 6u);
    Texture texture(Rgba8Image(2, 2));
    const Texture other = std::move(texture);
    EXPECT_TRUE(texture.empty());  // NOLINT(bugprone-use-after-move)
    EXPECT_FALSE(other.empty());
}

}  // namespace
}  // namespace stx
