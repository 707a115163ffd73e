#include "lib/metrics/immersive.hpp"

#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "lib/base/parallel.hpp"

namespace stx {
namespace {

using Picture = Image<glm::u8vec4>;

Picture smooth(int width, int height) {
    Picture p(width, height);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            p.at(x, y) = {static_cast<std::uint8_t>(40 + 7 * ((x * 5 + y * 3) % 23)),
                          static_cast<std::uint8_t>(30 + 8 * ((x + y * 7) % 19)),
                          static_cast<std::uint8_t>(50 + 9 * ((x * 2 + y) % 17)), 255};
    return p;
}

Picture greyPicture(int width, int height, int value) {
    const auto v = static_cast<std::uint8_t>(value);
    return {width, height, glm::u8vec4(v, v, v, 255)};
}

ImmersiveComparison of(const Picture& a, const Picture& b, const CompareSettings& s = {}) {
    ImmersiveComparison c;
    c.add(a, b, s);
    return c;
}

TEST(IvPsnr, OfIdenticalPicturesIsNothing) {
    const auto c = of(smooth(40, 20), smooth(40, 20));
    EXPECT_FALSE(c.ivPsnr());
    EXPECT_FALSE(c.wsPsnrY());
}

TEST(IvPsnr, IsThatOfOnePixelWherePixelsMovedByTwo) {
    const Picture a = smooth(64, 48);
    Picture b = a;
    for (int y = 0; y < 48; ++y)
        for (int x = 0; x < 64; ++x) b.at(x, y) = a.at((x + 2) % 64, y);
    const auto iv = of(a, b).ivPsnr();
    ASSERT_TRUE(iv);
    // The two columns at the right are new in b, and those at the left are not in it.
    EXPECT_LT(*iv, 60);
    EXPECT_GT(*iv, *compare(a, b)->psnrRgb + 10);
    Picture inside = a;
    inside.at(20, 20) = a.at(22, 21);
    inside.at(22, 21) = a.at(20, 20);
    EXPECT_NEAR(*of(a, inside).ivPsnr(), 10 * std::log10(64 * 48 * 255.0 * 255.0), 1e-6);
}

TEST(IvPsnr, TakesAMeanDifferenceOfOnePercentOut) {
    // 1 % is 2.55: what is left of 2 is nothing, of 4 it is 1.45.
    EXPECT_GT(*of(greyPicture(20, 30, 100), greyPicture(20, 30, 102)).ivPsnr(), 75);
    const double left = 10 * std::log10(255.0 * 255.0 / (1.45 * 1.45));
    const double chroma = 10 * std::log10(20 * 30 * 255.0 * 255.0);
    EXPECT_NEAR(*of(greyPicture(20, 30, 100), greyPicture(20, 30, 104)).ivPsnr(),
                (4 * left + 2 * chroma) / 6, 1e-3);
}

TEST(IvPsnr, IsTheSameFromBothSidesAndOnAnyThreads) {
    std::mt19937 random(3);
    Picture a = smooth(50, 40), b = a;
    for (auto& c : b.pixels()) c.g = static_cast<std::uint8_t>(c.g + random() % 9);
    const double iv = *of(a, b).ivPsnr();
    EXPECT_EQ(iv, *of(b, a).ivPsnr());
    const ThreadLimit one(1);
    EXPECT_EQ(iv, *of(a, b).ivPsnr());
}

TEST(IvPsnr, CountsPixelsOfTheMask) {
    Picture a = greyPicture(30, 30, 50), b = a;
    for (int y = 0; y < 10; ++y)
        for (int x = 0; x < 10; ++x) b.at(x, y) = {250, 10, 90, 255};
    Image<std::uint8_t> mask(30, 30, 255);
    for (int y = 0; y < 15; ++y)
        for (int x = 0; x < 15; ++x) mask.at(x, y) = 0;
    CompareSettings settings;
    settings.mask = &mask;
    EXPECT_FALSE(of(a, b, settings).ivPsnr());
    EXPECT_TRUE(of(a, b).ivPsnr());
}

TEST(IvPsnr, NeighboursThatTheMaskLeavesOutAreNoLikestOnes) {
    // The only pixel that is as the middle one is left out.
    Picture a = greyPicture(9, 9, 50), b = greyPicture(9, 9, 90);
    b.at(5, 5) = a.at(5, 5);
    Image<std::uint8_t> mask(9, 9, 255);
    mask.at(5, 5) = 0;
    CompareSettings settings;
    settings.mask = &mask;
    Picture plain = greyPicture(9, 9, 90);
    EXPECT_EQ(*of(a, b, settings).ivPsnr(), *of(a, plain, settings).ivPsnr());
}

TEST(WsPsnr, WeighsRowsByTheSphere) {
    // One row off by 10 in each: the weight of its row over that of all.
    const int height = 16, width = 32;
    double all = 0;
    for (int y = 0; y < height; ++y)
        all += std::cos((y + 0.5 - height / 2.0) * std::numbers::pi / height);
    for (const int row : {0, 5, 8}) {
        Picture b = greyPicture(width, height, 100);
        for (int x = 0; x < width; ++x) b.at(x, row) = {110, 110, 110, 255};
        const double weight = std::cos((row + 0.5 - height / 2.0) * std::numbers::pi / height);
        const auto ws = of(greyPicture(width, height, 100), b).wsPsnrY();
        ASSERT_TRUE(ws);
        EXPECT_NEAR(*ws, 10 * std::log10(255.0 * 255.0 / (100 * weight / all)), 1e-3);
    }
}

TEST(WsPsnr, IsOfPicturesTwiceAsWideAsHigh) {
    EXPECT_FALSE(of(greyPicture(30, 20, 1), greyPicture(30, 20, 9)).wsPsnrY());
    EXPECT_FALSE(of(greyPicture(30, 20, 1), greyPicture(30, 20, 9)).panoramas());
    EXPECT_TRUE(of(greyPicture(40, 20, 1), greyPicture(40, 20, 9)).panoramas());
}

TEST(ImmersiveComparison, AddsErrorsUpAndNotDecibels) {
    ImmersiveComparison both = of(greyPicture(40, 20, 100), greyPicture(40, 20, 110));
    both.add(of(greyPicture(40, 20, 100), greyPicture(40, 20, 100)));
    EXPECT_NEAR(*both.wsPsnrY(), 10 * std::log10(255.0 * 255.0 / 50), 1e-3);
}

}  // namespace
}  // namespace stx
