#include <gtest/gtest.h>

#include "formats/images/images.hpp"
#include "formats/stx/stx.hpp"
#include "tests/temporary_folder.hpp"

// Pictures that are compared from files.

namespace {

using namespace stx;

TEST(ComparePictures, TheSameColoursInEightAndSixteenBitsAreIdentical) {
    const TemporaryFolder folder;
    std::vector<std::uint8_t> bytes;
    std::vector<std::uint16_t> words;
    for (int v = 0; v < 256; ++v)
        for (int channel = 0; channel < 4; ++channel) {
            const int code = channel == 3 ? 255 - v / 2 : v;
            bytes.push_back(static_cast<std::uint8_t>(code));
            words.push_back(static_cast<std::uint16_t>(257 * code));
        }
    ASSERT_TRUE(writeFile(folder / "a.png", *encodePng(16, 16, 4, 8, bytes.data(), true), {}));
    ASSERT_TRUE(writeFile(folder / "b.png", *encodePng(16, 16, 4, 16, words.data(), true), {}));
    Job job;
    const auto a = openPicture(folder / "a.png", job), b = openPicture(folder / "b.png", job);
    ASSERT_TRUE(a && b);
    const auto found = compare(*a, *b, {}, job);
    ASSERT_TRUE(found) << found.error().text();
    EXPECT_TRUE(found->identical()) << found->differentPixels << " pixels differ";
    // One code of 16 bits is a difference.
    ++words[4 * 100];
    ASSERT_TRUE(writeFile(folder / "c.png", *encodePng(16, 16, 4, 16, words.data(), true), {}));
    const auto c = openPicture(folder / "c.png", job);
    ASSERT_TRUE(c);
    const auto other = compare(*a, *c, {}, job);
    ASSERT_TRUE(other);
    EXPECT_EQ(other->differentPixels, 1);
}

}  // namespace
