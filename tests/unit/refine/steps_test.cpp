#include "lib/refine/steps.hpp"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "lib/base/parallel.hpp"
#include "lib/geometry/depth_code.hpp"

namespace stx {
namespace {

double rms(const Image<float>& a, const Image<float>& b) {
    double sum = 0;
    std::int64_t n = 0;
    for (std::size_t i = 0; i < a.count(); ++i) {
        if (!hasPoint(a.data()[i])) continue;
        sum += std::pow(a.data()[i] - b.data()[i], 2);
        ++n;
    }
    return std::sqrt(sum / static_cast<double>(n));
}

template <class Surface>
Image<float> imageOf(const Surface& surface, int w = 160, int h = 120) {
    Image<float> out(w, h);
    for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x) out.at(x, y) = static_cast<float>(surface(x, y));
    return out;
}

Image<float> rounded(Image<float> image) {
    for (float& v : image.pixels()) v = std::round(v);
    return image;
}

/// Noise, treads, edges and unknown pixels: whatever comes in is got back by rounding.
TEST(DepthSteps, RoundingGivesBackWhatWasStored) {
    for (unsigned seed = 0; seed < 20; ++seed) {
        std::mt19937 random(seed);
        std::uniform_int_distribution<int> noise(-static_cast<int>(seed % 4), seed % 4),
            any(0, 255);
        const double slope = 0.01 * static_cast<double>(seed);
        auto stored = imageOf([&](int x, int y) {
            const int roll = any(random);
            if (roll < 10) return static_cast<double>(kNoDepth);
            if (roll < 12) return static_cast<double>(any(random));
            return std::clamp(
                std::round(40 + slope * x + 0.03 * y + (x > 90 ? 60 : 0) + noise(random)), 0.0,
                255.0);
        });
        auto smooth = stored;
        smoothDepthSteps(smooth);
        double most = 0;
        for (std::size_t i = 0; i < stored.count(); ++i) {
            const float a = stored.data()[i], b = smooth.data()[i];
            ASSERT_EQ(hasPoint(a), hasPoint(b));
            if (!hasPoint(a)) continue;
            ASSERT_EQ(std::round(b), a) << "seed " << seed << ": " << b;
            ASSERT_GE(b, 0);
            ASSERT_LE(b, 255);
            most = std::max(most, std::abs(static_cast<double>(b) - a));
        }
        EXPECT_GT(most, 0.3) << "nothing was smoothed";
        EXPECT_LE(most, kMostStepShift + 1e-5);
    }
}

TEST(DepthSteps, SurfacesComeNearerToTheTruth) {
    const auto slant = imageOf([](int x, int y) { return 50 + 0.07 * x + 0.03 * y; });
    const auto ball = imageOf([](int x, int y) {
        return 60 + 30 * std::sqrt(std::max(0.0, 1 - std::pow((x - 80) / 120.0, 2) -
                                                     std::pow((y - 60) / 120.0, 2)));
    });
    for (const auto& [truth, better] : {std::pair{slant, 3.5}, std::pair{ball, 2.0}}) {
        auto codes = rounded(truth);
        const double before = rms(truth, codes);
        EXPECT_NEAR(before, std::sqrt(1 / 12.0), 0.02);
        smoothDepthSteps(codes);
        EXPECT_LT(rms(truth, codes), before / better);
    }
}

/// One side of an edge is smoothed as if the other were not there.
TEST(DepthSteps, NothingIsCarriedAcrossAnEdge) {
    const auto left = [](int x, int y) { return std::round(50 + 0.07 * x + 0.03 * y); };
    auto alone = imageOf([&](int x, int y) { return x < 80 ? left(x, y) : kNoDepth; });
    auto both = imageOf([&](int x, int y) { return x < 80 ? left(x, y) : 90 - 0.0 * y; });
    alone.at(159, 0) = 90;  // the range of stored values is the same
    smoothDepthSteps(alone);
    smoothDepthSteps(both);
    for (int y = 0; y < 120; ++y) {
        for (int x = 0; x < 80; ++x) ASSERT_EQ(alone.at(x, y), both.at(x, y));
        for (int x = 80; x < 160; ++x) ASSERT_EQ(both.at(x, y), 90);
    }
}

TEST(DepthSteps, OneThreadAndManyGiveTheSame) {
    const auto codes =
        rounded(imageOf([](int x, int y) { return 50 + 8 * std::sin(x * 0.05) + 0.04 * y; }));
    auto one = codes, many = codes;
    {
        ThreadLimit limit(1);
        smoothDepthSteps(one);
    }
    {
        ThreadLimit limit(4);
        smoothDepthSteps(many);
    }
    EXPECT_EQ(one, many);
    Image<float> none;
    smoothDepthSteps(none);
    auto unknown = Image<float>(3, 2, kNoDepth);
    smoothDepthSteps(unknown);
    EXPECT_FALSE(hasPoint(unknown.at(0, 0)));
}

}  // namespace
}  // namespace stx
