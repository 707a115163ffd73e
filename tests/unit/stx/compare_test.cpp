#include <cmath>

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

TEST(ComparePictures, KeepTheLimitsOfTheirJobAndStopWithIt) {
    const Picture coded{Rgba8Image(512, 512, {1, 2, 3, 255})};
    Picture linear = coded;
    linear.linear = RgbaFloatImage(512, 512, glm::vec4(0.5f));
    Job job;
    ASSERT_TRUE(compare(coded, coded, {}, job));
    ASSERT_TRUE(compare(linear, linear, {}, job));
    // 36 bytes a pixel of 8 bits, and 80 of floats: 9 and 20 MiB.
    job.limits.maxMemoryBytes = 10 << 20;
    EXPECT_TRUE(compare(coded, coded, {}, job));
    for (const Picture& other : {coded, linear}) {
        const auto refused = compare(linear, other, {}, job);
        ASSERT_FALSE(refused);
        EXPECT_EQ(refused.error().code, ErrorCode::invalidInput);
        EXPECT_NE(refused.error().text().find("needs 20 MiB, more than the memory limit of 10 MiB"),
                  std::string::npos)
            << refused.error().text();
    }
    job.limits = {};
    job.cancelled = true;
    const auto stopped = compare(coded, coded, {}, job);
    ASSERT_FALSE(stopped);
    EXPECT_EQ(stopped.error().code, ErrorCode::failed);
}

TEST(ComparePictures, ABackgroundIsThreeNumbersOfZeroToOne) {
    const Picture clear{Rgba8Image(8, 8, {1, 2, 3, 0})}, red{Rgba8Image(8, 8, {255, 0, 0, 255})};
    Job job;
    for (const glm::vec3 wrong : {glm::vec3(NAN, 0, 0), glm::vec3(0, 2, 0), glm::vec3(0, 0, -1)}) {
        CompareSettings settings;
        settings.background = wrong;
        const auto refused = compare(clear, red, settings, job);
        ASSERT_FALSE(refused);
        EXPECT_EQ(refused.error().code, ErrorCode::usage);
        EXPECT_EQ(refused.error().text(),
                  fmt::format("the background is {:g}, {:g}, {:g}; values of 0 to 1 are expected",
                              wrong.r, wrong.g, wrong.b));
    }
}

}  // namespace
