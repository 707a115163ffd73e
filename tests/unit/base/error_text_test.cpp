#include "lib/base/error_text.hpp"

#include <gtest/gtest.h>

namespace stx {
namespace {

TEST(TextNamingOnce, NamesEachFileOnce) {
    const auto text = [](const char* where, const char* message) {
        return textNamingOnce({ErrorCode::invalidInput, message, where});
    };
    EXPECT_EQ(text("'a': 'a': line 3", "it is wrong"), "'a': line 3: it is wrong");
    EXPECT_EQ(text("'a'", "cannot read 'a': it is wrong"), "cannot read 'a': it is wrong");
    EXPECT_EQ(text("'a': line 3", "it is wrong"), "'a': line 3: it is wrong");
    EXPECT_EQ(text("'a': 'b'", "it is wrong"), "'a': 'b': it is wrong");
    EXPECT_EQ(text("", "it is wrong"), "it is wrong");
}

}  // namespace
}  // namespace stx
