// Features of two pictures, and the turn that they agree on.

#include "lib/panorama/matching.hpp"

#include <gtest/gtest.h>

#include <random>

#include "tests/unit/panorama/exact_matches.hpp"

namespace stx::panorama {
namespace {

/// A picture of discs, and the same turned by a right angle to the left.
WorkCopy discs(bool turned) {
    std::mt19937 random(5);
    const int w = 240, h = 180;
    Rgba8Image picture(w, h, glm::u8vec4(100, 110, 120, 255));
    for (int i = 0; i < 150; ++i) {
        const glm::dvec2 middle(random() % w, random() % h);
        const double radius = 4 + random() % 12;
        const glm::u8vec4 colour(random() % 256, random() % 256, random() % 256, 255);
        for (int y = 0; y < h; ++y)
            for (int x = 0; x < w; ++x)
                if (glm::distance(glm::dvec2(x, y), middle) < radius) picture.at(x, y) = colour;
    }
    if (!turned) return makeWorkCopy(std::move(picture), 1000);
    Rgba8Image other(h, w);
    for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x) other.at(y, w - 1 - x) = picture.at(x, y);
    return makeWorkCopy(std::move(other), 1000);
}

}  // namespace

TEST(PictureFeatures, AreCornersAndNotEdges) {
    Rgba8Image picture(120, 100, glm::u8vec4(40, 40, 40, 255));
    for (int y = 30; y < 70; ++y)
        for (int x = 35; x < 85; ++x) picture.at(x, y) = glm::u8vec4(220, 220, 220, 255);
    const Features found = findFeatures(makeWorkCopy(std::move(picture), 1000), 100);
    ASSERT_EQ(found.points.size(), found.descriptors.size());
    std::array<int, 4> corners{};
    const std::array<glm::vec2, 4> truth = {glm::vec2(35, 30), glm::vec2(85, 30), glm::vec2(35, 70),
                                            glm::vec2(85, 70)};
    for (const Feature& feature : found.points) {
        bool near = false;
        for (std::size_t k = 0; k < 4; ++k) {
            // What smooths the picture moves a corner inwards, the more the coarser the level.
            const float reach = 2.5f * std::exp2(static_cast<float>(feature.level) / 2);
            if (glm::distance(feature.pixel, truth[k]) > reach) continue;
            near = true;
            ++corners[k];
        }
        EXPECT_TRUE(near) << feature.pixel.x << ' ' << feature.pixel.y << ' ' << feature.level;
    }
    for (const int corner : corners) EXPECT_GE(corner, 1);
}

TEST(PictureFeatures, AreFoundAgainInAPictureThatIsTurned) {
    const WorkCopy a = discs(false), b = discs(true);
    const auto matches = matchFeatures(a, findFeatures(a, 400), b, findFeatures(b, 400));
    ASSERT_GT(matches.size(), 60u);
    std::size_t right = 0;
    for (const Match& match : matches) {
        const glm::dvec2 p = a.pixel(match.a);
        right += glm::distance(b.pixel(match.b), glm::dvec2(p.y, a.colour.width() - p.x)) < 1.5;
    }
    EXPECT_GT(static_cast<double>(right) / static_cast<double>(matches.size()), 0.95);
}

TEST(PictureMatches, WhatHasTwoPartnersIsLeftOut) {
    const WorkCopy copy = makeWorkCopy(Rgba8Image(100, 100), 1000);
    std::mt19937 random(7);
    Features a, b;
    for (int i = 0; i < 40; ++i) {
        Descriptor d;
        for (auto& byte : d) byte = static_cast<std::uint8_t>(random() % 60);
        a.points.push_back({glm::vec2(2 * i + 0.5f, 10.5f), 0, 1});
        a.descriptors.push_back(d);
        // The other picture shows it 30 pixels lower, in the opposite order, a little changed.
        for (auto& byte : d) byte = static_cast<std::uint8_t>(byte + random() % 3);
        b.points.insert(b.points.begin(), {glm::vec2(2 * i + 0.5f, 40.5f), 0, 1});
        b.descriptors.insert(b.descriptors.begin(), d);
    }
    // The seventh is there twice.
    b.points.push_back({glm::vec2(90.5f, 90.5f), 0, 1});
    b.descriptors.push_back(b.descriptors[40 - 1 - 7]);
    const auto matches = matchFeatures(copy, a, copy, b);
    EXPECT_EQ(matches.size(), 39u);
    for (const Match& match : matches) {
        const glm::dvec2 from = copy.pixel(match.a), to = copy.pixel(match.b);
        EXPECT_LT(glm::distance(to, from + glm::dvec2(0, 30)), 1e-4);
        EXPECT_GT(std::abs(from.x - 14.5), 0.5);
    }
}

TEST(PictureMatches, OneTurnIsFoundAmongThoseThatAreWrong) {
    TurnModel truth = turnedBy(0.35, 2, {1.4, 0});
    truth.worldFromCamera[1] = truth.worldFromCamera[1] * glm::angleAxis(0.3, glm::dvec3(0, 0, 1));
    const Pair exact = exactPair(truth, 0, 1);
    std::mt19937 random(11);
    const auto somewhere = [&] {
        return glm::dvec2(random() % 1000, random() % 1000) / 800.0 - glm::dvec2(0.6);
    };
    // Two of three are wrong.
    std::vector<Match> matches;
    for (const Match& match : exact.matches) {
        matches.push_back(match);
        matches.push_back({somewhere(), somewhere()});
        matches.push_back({match.a, somewhere()});
    }
    const Pair found = agreeingMatches(matches, truth.lens, 0.005);
    EXPECT_LT(angleBetween(found.bFromA, exact.bFromA), 0.002);
    EXPECT_GE(found.matches.size(), exact.matches.size());
    EXPECT_LE(found.matches.size(), exact.matches.size() + 2);
    // Where nothing agrees, few are left.
    for (Match& match : matches) match.b = somewhere();
    EXPECT_LT(agreeingMatches(matches, truth.lens, 0.005).matches.size(), 8u);
}

}  // namespace stx::panorama
