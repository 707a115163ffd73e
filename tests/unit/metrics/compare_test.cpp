#include "lib/metrics/compare.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <random>
#include <regex>
#include <string>

#include <gtest/gtest.h>

#include "lib/base/parallel.hpp"
#include "lib/metrics/ssim.hpp"

namespace stx {
namespace {

using Picture = Image<glm::u8vec4>;

Picture noise(int width, int height, unsigned seed, int amplitude = 256) {
    std::mt19937 random(seed);
    Picture p(width, height);
    const auto value = [&] { return static_cast<std::uint8_t>(random() % amplitude); };
    for (auto& c : p.pixels()) c = {value(), value(), value(), 255};
    return p;
}

TEST(Compare, IdenticalPicturesHaveNoDecibels) {
    const auto p = noise(40, 30, 1);
    const auto c = compare(p, p);
    ASSERT_TRUE(c);
    EXPECT_TRUE(c->identical());
    EXPECT_FALSE(c->psnrRgb);
    EXPECT_FALSE(c->psnrY);
    EXPECT_EQ(c->ssimY, 1.0);
    EXPECT_EQ(c->worst.difference, 0.0);
    EXPECT_EQ(c->pixels, 40 * 30);
}

TEST(Compare, AConstantDifferenceGivesItsDecibels) {
    // Every channel is off by 5: MSE 25, 10 log10(255^2 / 25) = 34.151404 dB, in RGB and in Y,
    // whose weights add up to one.
    const Picture a(32, 32, {100, 100, 100, 255}), b(32, 32, {105, 105, 105, 255});
    const auto c = compare(a, b);
    ASSERT_TRUE(c);
    EXPECT_NEAR(*c->psnrRgb, 34.151404, 1e-5);
    EXPECT_NEAR(*c->psnrY, 34.151404, 1e-5);
    // No variance: SSIM is its luminance term alone.
    const double c1 = 2.55 * 2.55;
    EXPECT_NEAR(c->ssimY, (2 * 100.0 * 105 + c1) / (100.0 * 100 + 105.0 * 105 + c1), 1e-6);
}

TEST(Compare, LumaWeighsTheChannelsAsBt709) {
    Picture a(10, 10, {0, 0, 0, 255}), b = a;
    b.at(3, 7) = {0, 200, 0, 255};
    const auto c = compare(a, b);
    ASSERT_TRUE(c);
    EXPECT_NEAR(*c->psnrRgb, 10 * std::log10(255.0 * 255 * 300 / (200.0 * 200)), 1e-6);
    EXPECT_NEAR(*c->psnrY, 10 * std::log10(255.0 * 255 * 100 / (143.04 * 143.04)), 1e-5);
    EXPECT_EQ(c->worst.x, 3);
    EXPECT_EQ(c->worst.y, 7);
    EXPECT_EQ(c->worst.difference, 200.0);
    EXPECT_EQ(c->differentPixels, 1);
}

TEST(Compare, MaskedOutPixelsDoNotCount) {
    Picture a(20, 20, {10, 20, 30, 255}), b = a;
    b.at(0, 0) = {255, 255, 255, 255};
    b.at(10, 10) = {11, 20, 30, 255};
    Image<std::uint8_t> mask(20, 20, 255);
    mask.at(0, 0) = 127;
    CompareSettings settings;
    settings.mask = &mask;
    const auto c = compare(a, b, settings);
    ASSERT_TRUE(c);
    EXPECT_EQ(c->pixels, 399);
    EXPECT_EQ(c->differentPixels, 1);
    EXPECT_EQ(c->worst.x, 10);
    EXPECT_EQ(c->worst.difference, 1.0);
    EXPECT_NEAR(*c->psnrRgb, 10 * std::log10(255.0 * 255 * 399 * 3), 1e-6);
    const auto picture = errorPicture(a, b, settings);
    ASSERT_TRUE(picture);
    EXPECT_EQ(picture->at(0, 0), glm::u8vec4(0, 0, 64, 255));
    EXPECT_EQ(picture->at(1, 1), glm::u8vec4(0, 0, 0, 255));
    EXPECT_EQ(picture->at(10, 10), glm::u8vec4(24, 0, 0, 255));  // 1 * gain 8 * 3

    Image<std::uint8_t> none(20, 20, 0);
    settings.mask = &none;
    EXPECT_FALSE(compare(a, b, settings));
    Image<std::uint8_t> small(19, 20, 255);
    settings.mask = &small;
    EXPECT_FALSE(compare(a, b, settings));
}

TEST(Compare, TransparentPixelsShowTheBackground) {
    Picture a(8, 8, {200, 0, 0, 0}), b(8, 8, {0, 0, 0, 255});
    ASSERT_TRUE(compare(a, b));
    EXPECT_TRUE(compare(a, b)->identical());
    CompareSettings white;
    white.background = glm::vec3(1.0f);
    EXPECT_EQ(compare(a, b, white)->worst.difference, 255.0);
    // Half covered red over black.
    a = Picture(8, 8, {200, 0, 0, 51});
    EXPECT_NEAR(compare(a, b)->worst.difference, 40.0, 1e-4);
}

TEST(Compare, FloatPicturesUseTheStatedPeak) {
    const Image<glm::vec4> a(16, 16, {1, 1, 1, 1}), b(16, 16, {1.5f, 1.5f, 1.5f, 1});
    CompareSettings settings;
    settings.peak = 4.0;
    const auto c = compare(a, b, settings);
    ASSERT_TRUE(c);
    EXPECT_NEAR(*c->psnrRgb, 20 * std::log10(4.0 / 0.5), 1e-6);
    EXPECT_NEAR(c->worst.difference, 0.5, 1e-7);
    settings.peak = 0;
    EXPECT_FALSE(compare(a, b, settings));
    auto bad = a;
    bad.at(2, 3).g = std::numeric_limits<float>::quiet_NaN();
    const auto error = compare(a, bad);
    ASSERT_FALSE(error);
    EXPECT_NE(error.error().message.find("(2, 3)"), std::string::npos);
}

TEST(Compare, WhatTheMaskLeavesOutMayBeNoNumber) {
    const Image<glm::vec4> a(24, 24, glm::vec4(0.2f, 0.4f, 0.6f, 1)),
        b(24, 24, glm::vec4(0.3f, 0.4f, 0.6f, 1));
    auto bad = a;
    bad.at(12, 12) = glm::vec4(std::numeric_limits<float>::quiet_NaN());
    Image<std::uint8_t> mask(24, 24, 255);
    mask.at(12, 12) = 0;
    CompareSettings settings;
    settings.mask = &mask;
    const auto good = compare(a, b, settings), masked = compare(bad, b, settings);
    ASSERT_TRUE(good && masked);
    EXPECT_EQ(*masked->psnrRgb, *good->psnrRgb);
    EXPECT_EQ(masked->ssimY, good->ssimY);
    EXPECT_EQ(masked->pixels, 24 * 24 - 1);
    EXPECT_FALSE(compare(bad, b));
}

TEST(Compare, ABackgroundThatIsNoColourIsRefused) {
    const Picture a(8, 8, {200, 0, 0, 0}), b(8, 8, {0, 0, 0, 255});
    CompareSettings settings;
    settings.background.g = std::numeric_limits<float>::quiet_NaN();
    const auto refused = compare(a, b, settings);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::usage);
    EXPECT_FALSE(errorPicture(a, b, settings));
}

TEST(Compare, StopsWithItsJob) {
    const Picture a(8, 8, {200, 0, 0, 255}), b(8, 8, {0, 0, 0, 255});
    Job job;
    EXPECT_TRUE(compare(a, b, {}, &job));
    job.cancelled = true;
    const auto stopped = compare(a, b, {}, &job);
    ASSERT_FALSE(stopped);
    EXPECT_EQ(stopped.error().code, ErrorCode::failed);
}

TEST(Compare, SizesMustMatch) {
    EXPECT_FALSE(compare(Picture(4, 4), Picture(4, 5)));
    EXPECT_FALSE(compare(Picture(), Picture()));
}

TEST(Compare, ASequenceAddsSquaredErrors) {
    const Picture a(16, 16, {0, 0, 0, 255}), b(16, 16, {10, 10, 10, 255});
    SequenceComparison sequence;
    sequence.add(*compare(a, a));
    sequence.add(*compare(a, b));
    const auto total = sequence.total();
    EXPECT_NEAR(*total.psnrRgb, 10 * std::log10(255.0 * 255 / 50.0), 1e-6);
    EXPECT_EQ(sequence.worstFrame(), 1);
    EXPECT_EQ(total.worst.difference, 10.0);
    EXPECT_EQ(total.pixels, 512);
}

TEST(Compare, TheWorstPixelOfASequenceIsTheLargestPartOfWhite) {
    Comparison coded, codes16, linear;
    coded.worst = {1, 2, 179};
    codes16.worst = {3, 4, 327};
    codes16.white = 65535;
    linear.worst = {5, 6, 0.69};
    linear.white = 1;
    SequenceComparison sequence;
    for (const Comparison& frame : {codes16, coded, linear}) sequence.add(frame);
    EXPECT_EQ(sequence.worstFrame(), 1);
    EXPECT_EQ(sequence.total().worst.difference, 179);
    EXPECT_EQ(sequence.total().white, 255);
    linear.worst.difference = 0.71;
    sequence.add(linear);
    EXPECT_EQ(sequence.worstFrame(), 3);
}

TEST(Compare, ThreadsDoNotChangeTheResult) {
    const auto a = noise(301, 203, 3), b = noise(301, 203, 4);
    const auto many = compare(a, b);
    const ThreadLimit one(1);
    const auto single = compare(a, b);
    EXPECT_EQ(*many->psnrRgb, *single->psnrRgb);
    EXPECT_EQ(*many->psnrY, *single->psnrY);
    EXPECT_EQ(many->ssimY, single->ssimY);
}

// The definition of Wang et al. written down directly, window by window, in two dimensions.
double ssimByDefinition(const Image<float>& a, const Image<float>& b, int cx, int cy, double peak) {
    double sum = 0, ma = 0, mb = 0, va = 0, vb = 0, cov = 0;
    for (int pass = 0; pass < 2; ++pass) {
        for (int v = -5; v <= 5; ++v) {
            for (int u = -5; u <= 5; ++u) {
                const double w = std::exp(-(u * u + v * v) / (2 * 1.5 * 1.5));
                const double pa = a.at(cx + u, cy + v), pb = b.at(cx + u, cy + v);
                if (pass == 0) {
                    sum += w;
                    ma += w * pa;
                    mb += w * pb;
                } else {
                    va += w / sum * (pa - ma) * (pa - ma);
                    vb += w / sum * (pb - mb) * (pb - mb);
                    cov += w / sum * (pa - ma) * (pb - mb);
                }
            }
        }
        if (pass == 0) {
            ma /= sum;
            mb /= sum;
        } else {
            const double c1 = std::pow(0.01 * peak, 2), c2 = std::pow(0.03 * peak, 2);
            return (2 * ma * mb + c1) * (2 * cov + c2) /
                   ((ma * ma + mb * mb + c1) * (va + vb + c2));
        }
    }
    return 0;
}

TEST(Ssim, AgreesWithItsDefinition) {
    std::mt19937 random(7);
    Image<float> a(24, 20), b(24, 20);
    for (int y = 0; y < 20; ++y) {
        for (int x = 0; x < 24; ++x) {
            a.at(x, y) = static_cast<float>(128 + 60 * std::sin(x * 0.7) * std::cos(y * 0.4));
            b.at(x, y) = a.at(x, y) + static_cast<float>(random() % 41) - 20.0f;
        }
    }
    const auto map = ssimMap(a, b, 255);
    double mean = 0;
    for (int y = 5; y < 15; ++y) {
        for (int x = 5; x < 19; ++x) {
            const double expected = ssimByDefinition(a, b, x, y, 255);
            EXPECT_NEAR(map.at(x, y), expected, 1e-6);
            mean += expected / (10 * 14);
        }
    }
    EXPECT_NEAR(meanSsim(a, b, 255, nullptr), mean, 1e-6);
    // A mask cuts windows as a border does: the right half.
    Image<float> rightA(12, 20), rightB(12, 20);
    Image<std::uint8_t> right(24, 20, 0);
    for (int y = 0; y < 20; ++y)
        for (int x = 0; x < 12; ++x) {
            right.at(x + 12, y) = 255;
            rightA.at(x, y) = a.at(x + 12, y);
            rightB.at(x, y) = b.at(x + 12, y);
        }
    const auto half = ssimMap(rightA, rightB, 255), masked = ssimMap(a, b, 255, &right);
    for (int y = 0; y < 20; ++y)
        for (int x = 0; x < 12; ++x) EXPECT_NEAR(masked.at(x + 12, y), half.at(x, y), 1e-6);
    EXPECT_EQ(masked.at(3, 3), 1.0f);
    EXPECT_GT(mean, 0.3);
    EXPECT_LT(mean, 0.99);
}

std::string outputOf(const std::string& command) {
    std::string out;
    if (FILE* pipe = popen(command.c_str(), "r")) {
        std::array<char, 256> chunk{};
        while (std::fgets(chunk.data(), chunk.size(), pipe)) out += chunk.data();
        pclose(pipe);
    }
    return out;
}

void writePpm(const Picture& p, const std::string& path) {
    std::ofstream f(path, std::ios::binary);
    f << "P6\n" << p.width() << " " << p.height() << "\n255\n";
    for (const auto& c : p.pixels()) f.put(char(c.r)).put(char(c.g)).put(char(c.b));
}

TEST(Compare, AgreesWithIdiff) {
    if (std::system("idiff --help >/dev/null 2>&1") != 0)
        GTEST_SKIP() << "needs OpenImageIO's idiff";
    const auto a = noise(61, 47, 11), b = noise(61, 47, 12, 200);
    const std::string dir = testing::TempDir();
    writePpm(a, dir + "stx_compare_a.ppm");
    writePpm(b, dir + "stx_compare_b.ppm");
    const auto text =
        outputOf("idiff -v " + dir + "stx_compare_a.ppm " + dir + "stx_compare_b.ppm 2>&1");
    const auto c = compare(a, b);
    ASSERT_TRUE(c);
    std::smatch m;
    ASSERT_TRUE(std::regex_search(text, m, std::regex("Peak SNR = ([0-9.]+)"))) << text;
    EXPECT_NEAR(*c->psnrRgb, std::stod(m[1]), 2e-3) << text;
    ASSERT_TRUE(std::regex_search(text, m, std::regex("Max error *= ([0-9.]+)"))) << text;
    EXPECT_NEAR(c->worst.difference / 255.0, std::stod(m[1]), 1e-4) << text;
}

}  // namespace
}  // namespace stx
