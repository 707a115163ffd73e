// How pictures belong together, of matches that are exact.

#include "lib/panorama/order.hpp"

#include <gtest/gtest.h>

#include "tests/unit/panorama/exact_matches.hpp"

namespace stx::panorama {
namespace {

/// Pairs of each picture with the next one, and of the last with the first when a turn closes.
std::vector<Pair> neighbours(const TurnModel& truth, bool closed) {
    const auto count = static_cast<int>(truth.known.size());
    std::vector<Pair> pairs;
    for (int k = 0; k + 1 < count; ++k) pairs.push_back(exactPair(truth, k, k + 1));
    if (closed) pairs.push_back(exactPair(truth, 0, count - 1));
    return pairs;
}

Pair pairWith(int a, int b, std::size_t matches) {
    Pair pair;
    pair.a = a;
    pair.b = b;
    pair.matches.resize(matches);
    return pair;
}

}  // namespace

TEST(PictureTree, IsTheLargestPartByTheStrongestPairs) {
    // 0 to 3 are connected in a circle, of which 0-3 is the weakest; 4 and 5 are by themselves.
    const std::vector<Pair> pairs = {pairWith(0, 3, 10), pairWith(0, 1, 50), pairWith(1, 2, 40),
                                     pairWith(2, 3, 30), pairWith(4, 5, 500)};
    const PictureTree tree = treeOf(7, pairs);
    EXPECT_EQ(tree.order, (std::vector{1, 0, 2, 3}));
    EXPECT_EQ(tree.parent, (std::vector{1, -1, 1, 2, -1, -1, -1}));
    EXPECT_EQ(tree.pair, (std::vector{1, -1, 2, 3, -1, -1, -1}));
    EXPECT_FALSE(tree.inTree[0]);
    EXPECT_TRUE(tree.inTree[1] && tree.inTree[2] && tree.inTree[3]);
}

TEST(PictureTree, ItsChainHasTheTurnsThatMatchesSay) {
    TurnModel truth = turnedBy(0.4, 5, {1.5, 0.05});
    truth.worldFromCamera[3] =
        truth.worldFromCamera[3] * glm::angleAxis(0.2, glm::normalize(glm::dvec3(1, 0.3, -0.5)));
    auto pairs = neighbours(truth, false);
    // What a pair was started from does not count.
    for (Pair& pair : pairs) pair.bFromA = glm::angleAxis(0.01, glm::dvec3(0, 0, 1)) * pair.bFromA;
    const TurnModel found = chain(treeOf(6, pairs), pairs, truth.lens);
    EXPECT_LT(worstTurn(found, truth), 1e-4);
    EXPECT_TRUE(found.known[4]);
    EXPECT_FALSE(found.known[5]) << "no pair shows it";
}

TEST(PictureTree, ATurnThatClosesTellsTheFocalLength) {
    const TurnModel truth = turnedBy(2 * M_PI / 12, 12, {1.3, 0});
    for (const double wrong : {1.15, 0.88}) {
        const auto pairs = neighbours(truth, true);
        const double found = focalByClosing(treeOf(12, pairs), pairs, wrong * 1.3);
        EXPECT_NEAR(found / 1.3, 1, 0.007) << wrong;  // half a step
        // A turn that stays open does not tell it.
        const auto open = neighbours(truth, false);
        EXPECT_EQ(focalByClosing(treeOf(12, open), open, wrong * 1.3), wrong * 1.3);
    }
}

TEST(PictureTree, OnlyPairsThatGoAllAroundClose) {
    const TurnModel truth = turnedBy(2 * M_PI / 12, 12, {1.3, 0});
    auto pairs = neighbours(truth, true);
    // Beside the tree, too, but its path goes the same short way.
    pairs.push_back(exactPair(truth, 4, 6));
    ASSERT_LT(pairs.back().matches.size(), pairs[4].matches.size());
    const PictureTree tree = treeOf(12, pairs);
    const std::vector<int> closing = pairsThatClose(tree, pairs, truth);
    ASSERT_EQ(closing.size(), 1u);
    EXPECT_FALSE(tree.inTree[static_cast<std::size_t>(closing[0])]);
    EXPECT_NE(closing[0], 12) << "the short way";
}

TEST(PictureLevel, UpIsTheAxisOfTheTurnWhateverTheRolls) {
    // The world itself lies askew; some pictures are portraits, all are held by hand.
    const glm::dquat askew = glm::angleAxis(0.7, glm::normalize(glm::dvec3(1, 2, -1)));
    TurnModel model = turnedBy(0.5, 10, {1.3, 0});
    for (std::size_t k = 0; k < 10; ++k) {
        const double roll = (k % 3 == 1 ? 90 : 0) + (k % 2 == 0 ? 0.4 : -0.4);
        const double pitch = static_cast<double>(k % 4) * 6 - 9;
        model.worldFromCamera[k] = askew * model.worldFromCamera[k] *
                                   glm::angleAxis(pitch * kDegree, glm::dvec3(1, 0, 0)) *
                                   glm::angleAxis(roll * kDegree, glm::dvec3(0, 0, 1));
    }
    EXPECT_GT(glm::dot(upOf(model), askew * glm::dvec3(0, 1, 0)), std::cos(0.5 * kDegree));
}

TEST(PictureLevel, TheMiddleOfWhatIsSeenLiesAhead) {
    // Three pictures from 60 to 120 degrees to the left, around an axis that is askew.
    const glm::dquat askew = glm::angleAxis(1.1, glm::normalize(glm::dvec3(2, 1, 1)));
    TurnModel model = turnedBy(0.5, 3, {1.3, 0});
    for (auto& turn : model.worldFromCamera) turn = askew * turn;
    const glm::dvec3 up = askew * glm::dvec3(0, 1, 0);
    const auto ahead = [&](std::size_t k, bool closed) {
        return levelTurn(model, up, closed) * model.worldFromCamera[k] * glm::dvec3(0, 0, -1);
    };
    EXPECT_LT(glm::distance(levelTurn(model, up, false) * up, glm::dvec3(0, 1, 0)), 1e-9);
    EXPECT_LT(glm::distance(ahead(1, false), glm::dvec3(0, 0, -1)), 1e-9);
    EXPECT_LT(ahead(2, false).x, -0.4) << "a turn to the left is to the left";
    EXPECT_LT(glm::distance(ahead(0, true), glm::dvec3(0, 0, -1)), 1e-9)
        << "a turn that closes begins with its first picture";
}

}  // namespace stx::panorama
