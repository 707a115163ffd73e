#include "lib/metrics/steadiness.hpp"

#include <gtest/gtest.h>

namespace stx {
namespace {

Image<glm::u8vec4> grey(int value, int alpha = 255) {
    const auto v = static_cast<std::uint8_t>(value);
    return {4, 3, glm::u8vec4(v, v, v, static_cast<std::uint8_t>(alpha))};
}

TEST(Steadiness, AnErrorThatStaysIsSteady) {
    Steadiness s;
    for (const int truth : {10, 60, 35}) s.add(grey(truth + 20), grey(truth), {});
    EXPECT_EQ(s.steps(), 2);
    EXPECT_DOUBLE_EQ(s.mean(), 0.0);
    EXPECT_DOUBLE_EQ(s.worst(), 0.0);
}

TEST(Steadiness, AnErrorThatComesAndGoesIsCounted) {
    Steadiness s;
    s.add(grey(10), grey(10), {});
    s.add(grey(90), grey(80), {});  // 10 more than the truth changed
    s.add(grey(50), grey(80), {});  // 40 less
    s.add(grey(50), grey(80), {});
    EXPECT_EQ(s.steps(), 3);
    EXPECT_DOUBLE_EQ(s.mean(), 50.0 / 3);
    EXPECT_DOUBLE_EQ(s.worst(), 40.0);
    EXPECT_EQ(s.worstFrame(), 2);
}

TEST(Steadiness, OnlyPixelsOfTheMaskCountAndAlphaIsLaidOverTheBackground) {
    Image<std::uint8_t> mask(4, 3, std::uint8_t{0});
    mask.at(1, 1) = 255;
    CompareSettings settings;
    settings.mask = &mask;
    Steadiness s;
    s.add(grey(0), grey(0), settings);
    auto changed = grey(0);
    changed.at(0, 0) = glm::u8vec4(255);
    changed.at(1, 1) = glm::u8vec4(30, 30, 30, 255);
    s.add(changed, grey(0), settings);
    EXPECT_DOUBLE_EQ(s.mean(), 30.0);
    // What nobody sees is not a change.
    s.add(changed, grey(200, 0), settings);
    EXPECT_DOUBLE_EQ(s.mean(), 15.0);
}

TEST(Steadiness, FramesOfAnotherKindAreInTheValuesOfTheFirst) {
    const Image<glm::vec4> white(4, 3, glm::vec4(1)), black(4, 3, glm::vec4(0, 0, 0, 1));
    Steadiness s;
    s.add(grey(255), grey(0), {});
    s.add(white, black, {});
    EXPECT_DOUBLE_EQ(s.mean(), 0.0);
    s.add(black, black, {});
    EXPECT_DOUBLE_EQ(s.worst(), 255.0);
    Steadiness floats;
    floats.add(white, black, {});
    floats.add(grey(0), grey(0), {});
    EXPECT_DOUBLE_EQ(floats.worst(), 1.0);
}

TEST(Steadiness, FramesOfAnotherSizeStartAnew) {
    Steadiness s;
    s.add(grey(0), grey(0), {});
    s.add(Image<glm::u8vec4>(2, 2, glm::u8vec4(255)), Image<glm::u8vec4>(2, 2, glm::u8vec4(0)), {});
    EXPECT_EQ(s.steps(), 0);
}

}  // namespace
}  // namespace stx
