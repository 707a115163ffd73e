#include "lib/base/unique_names.hpp"

#include <gtest/gtest.h>

namespace stx {
namespace {

TEST(UniqueNames, TakenNamesGetTheLowestFreeNumber) {
    UniqueNames names("_", 1);
    EXPECT_EQ(names.take("a"), "a");
    EXPECT_EQ(names.take("a"), "a_1");
    EXPECT_EQ(names.take("a_2"), "a_2");
    EXPECT_EQ(names.take("a"), "a_3");
    EXPECT_EQ(names.take("a_2"), "a_2_1");
    EXPECT_EQ(names.take(""), "");
    EXPECT_EQ(names.take(""), "_1");
    UniqueNames spaced(" ", 2);
    EXPECT_EQ(spaced.take("a"), "a");
    EXPECT_EQ(spaced.take("a"), "a 2");
}

// Trying each number anew would be 5,000,000,000 names.
TEST(UniqueNames, ManyOfOneName) {
    UniqueNames names("_", 1);
    std::string last;
    for (int i = 0; i < 100'000; ++i) last = names.take("view");
    EXPECT_EQ(last, "view_99999");
}

}  // namespace
}  // namespace stx
