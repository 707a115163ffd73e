#include "lib/render/surface/prepare/outline_levels.hpp"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "lib/geometry/cut_pixel.hpp"
#include "lib/render/surface/prepare/constants.hpp"

namespace stx::surface {
namespace {

constexpr int kPlaneSide = 12;

/// What a half plane leaves covered of each pixel: what is below `below` along `out` from the
/// middle on.
Texture halfPlane(glm::vec2 out, float below) {
    Rgba8Image image(kPlaneSide, kPlaneSide, glm::u8vec4(90, 90, 90, 0));
    for (int y = 0; y < kPlaneSide; ++y)
        for (int x = 0; x < kPlaneSide; ++x) {
            const glm::vec2 at = glm::vec2(x, y) + 0.5f - 0.5f * kPlaneSide;
            const float cover = areaBelow(below - glm::dot(out, at), out.x, out.y);
            image.at(x, y).a = static_cast<std::uint8_t>(std::lround(255 * cover));
        }
    return Texture(std::move(image));
}

template <class At>
float bilinear(glm::vec2 place, const At& at) {
    const glm::vec2 f = glm::floor(place - 0.5f), t = place - 0.5f - f;
    const int x = static_cast<int>(f.x), y = static_cast<int>(f.y);
    return glm::mix(glm::mix(at(x, y), at(x + 1, y), t.x),
                    glm::mix(at(x, y + 1), at(x + 1, y + 1), t.x), t.y);
}

float levelOf(std::uint8_t byte) {
    return (static_cast<float>(byte) - kLevelZero) * kLevelStep;
}

TEST(OutlineLevels, AreOneHalfOnStraightOutlines) {
    std::mt19937 random(5);
    std::uniform_real_distribution<float> angles(0.0f, 6.2832f), offsets(-1.0f, 1.0f);
    double levelsOff = 0, alphasOff = 0;
    float farthest = 0;
    int count = 0;
    for (int line = 0; line < 300; ++line) {
        const float angle = angles(random), below = offsets(random);
        const glm::vec2 out(std::cos(angle), std::sin(angle));
        const Texture texture = halfPlane(out, below);
        const Image<std::uint8_t> levels = outlineLevels(texture);
        for (int k = 0; k < 8; ++k) {
            const glm::vec2 on = below * out + 3.0f * offsets(random) * glm::vec2(-out.y, out.x);
            const glm::vec2 at = on + 0.5f * kPlaneSide;
            const float level =
                bilinear(at, [&](int x, int y) { return levelOf(levels.at(x, y)); });
            const float alpha = bilinear(
                at, [&](int x, int y) { return texture.rgba8()->at(x, y).a * (1 / 255.0f); });
            levelsOff += std::abs(level - 0.5f);
            alphasOff += std::abs(alpha - 0.5f);
            farthest = std::max(farthest, std::abs(level - 0.5f));
            ++count;
        }
    }
    EXPECT_LT(levelsOff / count, 0.01);
    EXPECT_GT(alphasOff / count, 0.025);  // what this is for
    EXPECT_LT(farthest, 0.08f);
}

TEST(OutlineLevels, AreAlphaWhereThatIsNoOutline) {
    // A bar thinner than a pixel, a mask of two values, and a soft ramp.
    Rgba8Image image(kPlaneSide, kPlaneSide, glm::u8vec4(0));
    for (int y = 0; y < kPlaneSide; ++y) {
        image.at(2, y).a = 140;
        for (int x = 5; x < 7; ++x) image.at(x, y).a = 255;
        for (int x = 8; x < kPlaneSide; ++x)
            image.at(x, y).a = static_cast<std::uint8_t>((x - 7) * 50);
    }
    const Rgba8Image given = image;
    const Image<std::uint8_t> levels = outlineLevels(Texture(std::move(image)));
    for (int y = 0; y < kPlaneSide; ++y)
        for (int x = 0; x < kPlaneSide; ++x)
            EXPECT_NEAR(levelOf(levels.at(x, y)), given.at(x, y).a / 255.0f, 0.006)
                << x << ' ' << y;
}

TEST(OutlineLevels, OfOnePixelAreItsAlpha) {
    for (const int alpha : {0, 128, 255}) {
        const Image<std::uint8_t> levels =
            outlineLevels(Texture(Rgba8Image(1, 1, glm::u8vec4(9, 9, 9, alpha))));
        EXPECT_NEAR(levelOf(levels.at(0, 0)), static_cast<float>(alpha) / 255.0f, 0.006);
    }
}

}  // namespace
}  // namespace stx::surface
