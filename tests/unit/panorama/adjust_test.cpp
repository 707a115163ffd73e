// Rotations and the lens, of matches whose errors are known.

#include "lib/panorama/adjust.hpp"

#include <gtest/gtest.h>

#include "tests/unit/panorama/exact_matches.hpp"

namespace stx::panorama {
namespace {

std::vector<Pair> overlaps(const TurnModel& truth) {
    const auto count = static_cast<int>(truth.known.size());
    std::vector<Pair> pairs;
    for (int k = 0; k < count; ++k) pairs.push_back(exactPair(truth, k, (k + 1) % count));
    return pairs;
}

/// The truth, with all that is looked for changed a little.
TurnModel disturbed(TurnModel model) {
    model.lens = {model.lens.focal * 1.05, 0};
    for (std::size_t k = 1; k < model.worldFromCamera.size(); ++k)
        model.worldFromCamera[k] =
            model.worldFromCamera[k] *
            quatOf(0.02 * glm::dvec3(std::sin(k), std::cos(2.0 * static_cast<double>(k)), 0.5));
    return model;
}

}  // namespace

TEST(BlockAdjustment, FindsTurnsFocalLengthAndDistortion) {
    const TurnModel truth = turnedBy(2 * M_PI / 10, 10, {1.25, -0.06});
    TurnModel model = disturbed(truth);
    AdjustSettings settings;
    settings.expectedFocal = model.lens.focal;
    settings.noisePixels = 0.01;
    const double cost = adjust(model, overlaps(truth), settings);
    EXPECT_LT(worstTurn(model, truth), 0.002);
    EXPECT_NEAR(model.lens.focal, 1.25, 1e-4);
    EXPECT_NEAR(model.lens.k1, -0.06, 1e-3);
    EXPECT_LT(cost, 0.1);
    EXPECT_EQ(model.worldFromCamera[0], truth.worldFromCamera[0]) << "the first one stays";
}

TEST(BlockAdjustment, LeavesWhatIsSaidToBeKnown) {
    const TurnModel truth = turnedBy(2 * M_PI / 10, 10, {1.25, -0.06});
    TurnModel model = disturbed(truth);
    model.known[4] = false;
    const TurnModel before = model;
    AdjustSettings settings;
    settings.fixFocal = settings.fixDistortion = true;
    std::vector<Pair> pairs = overlaps(truth);
    std::erase_if(pairs, [](const Pair& pair) { return pair.a == 4 || pair.b == 4; });
    (void)adjust(model, pairs, settings);
    EXPECT_EQ(model.lens.focal, before.lens.focal);
    EXPECT_EQ(model.lens.k1, before.lens.k1);
    EXPECT_EQ(model.worldFromCamera[4], before.worldFromCamera[4]) << "not part of the whole";
    EXPECT_NE(model.worldFromCamera[5], before.worldFromCamera[5]);
}

TEST(BlockAdjustment, WrongMatchesDoNotMoveIt) {
    // A fifth of the matches are off by 50 pixels, all to one side.
    const TurnModel truth = turnedBy(2 * M_PI / 10, 10, {1.25, 0});
    std::vector<Pair> pairs = overlaps(truth);
    for (Pair& pair : pairs)
        for (std::size_t i = 0; i < pair.matches.size(); i += 5) pair.matches[i].b.y += 0.05;
    TurnModel model = truth;
    AdjustSettings settings;
    settings.fixFocal = settings.fixDistortion = true;
    settings.cauchy = true;
    (void)adjust(model, pairs, settings);
    EXPECT_LT(worstTurn(model, truth), 0.01);
}

TEST(BlockAdjustment, DifferencesAreInPixelsOfBothPictures) {
    const TurnModel truth = turnedBy(0.3, 2, {1.25, 0.02});
    const Pair pair = exactPair(truth, 0, 1);
    Match match = pair.matches[5];
    EXPECT_LT(differenceOf(truth, pair, match, 1e-3), 1e-9);
    // Off by 4 pixels in b is off by 5 in a, which sees that place farther from its middle.
    match.b.x += 4e-3;
    EXPECT_NEAR(differenceOf(truth, pair, match, 1e-3), 4.5, 0.3);
    // A picture to the back sees nothing of it.
    const TurnModel back = turnedBy(M_PI, 2, {1.25, 0});
    EXPECT_FALSE(seenBy(back, 0, 1, {0, 0}));
    EXPECT_GT(differenceOf(back, pair, match, 1e-3), 1000);
}

}  // namespace stx::panorama
