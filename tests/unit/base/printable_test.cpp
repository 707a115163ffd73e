#include "lib/base/printable.hpp"

#include <gtest/gtest.h>

namespace stx {
namespace {

TEST(Printable, KeepsWhatCanBeShown) {
    const std::string text = "plain, a\\b, \"ü\", 日本, \xF0\x9F\x8E\xA8";
    EXPECT_EQ(printable(text), text);
    EXPECT_EQ(printableLines("a\nb\n"), "a\nb\n");
}

TEST(Printable, EscapesControlCharacters) {
    EXPECT_EQ(printable("a\x1b[2Jb"), "a\\x1b[2Jb");
    EXPECT_EQ(printable("a\nb\rc\td"), "a\\nb\\rc\\td");
    EXPECT_EQ(printable(std::string("\0\x7f", 2)), "\\x00\\x7f");
    // CSI as one character of C1; a line separator; the override that writes from right to left.
    EXPECT_EQ(printable("\xC2\x9B"), "\\xc2\\x9b");
    EXPECT_EQ(printable("\xE2\x80\xA8"), "\\xe2\\x80\\xa8");
    EXPECT_EQ(printable("\xE2\x80\xAE"), "\\xe2\\x80\\xae");
    EXPECT_EQ(printableLines("a\x1b\nb\r"), "a\\x1b\nb\\r");
}

TEST(Printable, EscapesWhatIsNoUtf8) {
    // A lone CSI, a cut sequence, detours, a surrogate, beyond Unicode.
    EXPECT_EQ(printable("\x9B"), "\\x9b");
    EXPECT_EQ(printable("a\xC3"), "a\\xc3");
    EXPECT_EQ(printable("\xE2\x80"), "\\xe2\\x80");
    EXPECT_EQ(printable("\xC0\x9B"), "\\xc0\\x9b");
    EXPECT_EQ(printable("\xE0\x9F\xBF"), "\\xe0\\x9f\\xbf");
    EXPECT_EQ(printable("\xED\xA0\x80"), "\\xed\\xa0\\x80");
    EXPECT_EQ(printable("\xF4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80");
    EXPECT_EQ(printable("\xFFx"), "\\xffx");
}

}  // namespace
}  // namespace stx
