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

/// A camera that turned to the left by `yaw`, then up by `pitch`, and rolled; degrees.
glm::dquat heldAt(double yaw, double pitch, double roll = 0) {
    return glm::angleAxis(yaw * kDegree, glm::dvec3(0, 1, 0)) *
           glm::angleAxis(pitch * kDegree, glm::dvec3(1, 0, 0)) *
           glm::angleAxis(roll * kDegree, glm::dvec3(0, 0, 1));
}

/// Pictures that look up by 38 degrees, `step` degrees apart, and a last one near the zenith.
TurnModel withZenith(int pictures, double step) {
    TurnModel model = turnedBy(0, pictures + 1, {1, 0});
    for (int k = 0; k < pictures; ++k)
        model.worldFromCamera[static_cast<std::size_t>(k)] = heldAt(step * k, 38);
    model.worldFromCamera.back() = heldAt(-100, 84);
    return model;
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

TEST(PictureTree, ALoopThatStaysOpenIsCutBetweenTheLastAndTheFirst) {
    // The last and the first have the most in common, and 5 and 6 the least.
    const TurnModel truth = turnedBy(2 * M_PI / 12, 12, {1.3, 0});
    auto pairs = neighbours(truth, true);
    pairs.back().matches.resize(500);
    pairs[5].matches.resize(10);
    pairs.push_back(exactPair(truth, 0, 10));
    pairs.back().matches.resize(300);
    const PictureTree closed = treeOf(12, pairs), open = treeOf(12, pairs, false);
    EXPECT_TRUE(closed.inTree[11] && closed.inTree[12] && !closed.inTree[5]);
    EXPECT_TRUE(open.inTree[5] && !open.inTree[11] && !open.inTree[12]);
    EXPECT_EQ(dropPairsThatClose(open, pairs, truth),
              (std::vector<std::pair<int, int>>{{0, 10}, {0, 11}}));
    ASSERT_EQ(pairs.size(), 11u);
    for (const Pair& pair : pairs) EXPECT_EQ(pair.b, pair.a + 1);
    // What is joined nowhere else is joined there.
    pairs.erase(pairs.begin() + 5);
    pairs.push_back(pairWith(0, 11, 8));
    EXPECT_EQ(treeOf(12, pairs, false).order.size(), 12u);
}

TEST(PictureTree, APictureOfTheZenithDoesNotGoAllAround) {
    // From it, pictures to both sides of what is behind it are near.
    const TurnModel part = withZenith(6, 30);
    auto pairs = neighbours(part, false);
    for (int k = 0; k < 5; ++k) pairs.push_back(exactPair(part, k, 6));
    EXPECT_TRUE(pairsThatClose(treeOf(7, pairs), pairs, part).empty());

    // All are joined by it, and yet the ring below it closes once; one that stays open between the
    // last and the first, whatever they have in common.
    const TurnModel ring = withZenith(12, 30);
    pairs.clear();
    for (int k = 0; k < 11; ++k) pairs.push_back(exactPair(ring, k, k + 1));
    pairs.push_back(exactPair(ring, 0, 11));
    pairs.back().matches.resize(400);
    for (int k = 0; k < 12; ++k) {
        pairs.push_back(exactPair(ring, k, 12));
        pairs.back().matches.resize(500);
    }
    PictureTree star = treeOf(13, pairs);
    for (std::size_t p = 0; p < 12; ++p) ASSERT_FALSE(star.inTree[p]);
    const auto closing = pairsThatClose(star, pairs, ring);
    ASSERT_EQ(closing.size(), 1u);
    EXPECT_LT(closing[0], 11);
    star.closeLoop = false;
    EXPECT_EQ(pairsThatClose(star, pairs, ring), std::vector{11});
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

TEST(PictureLevel, UpIsTheAxisWhereAllLookSteeplyUpOrDown) {
    const glm::dquat askew = glm::angleAxis(0.7, glm::normalize(glm::dvec3(1, 2, -1)));
    for (const double pitch : {45.0, 50.0, 60.0, -50.0})
        for (const double roll : {0.0, 90.0}) {
            TurnModel model = turnedBy(0, 8, {1, 0});
            for (int k = 0; k < 8; ++k)
                model.worldFromCamera[static_cast<std::size_t>(k)] =
                    askew * heldAt(45 * k, pitch, roll + (k % 2 == 0 ? 0.3 : -0.3));
            EXPECT_GT(glm::dot(upOf(model), askew * glm::dvec3(0, 1, 0)), std::cos(0.5 * kDegree))
                << pitch << " " << roll;
        }
}

TEST(PictureLevel, PicturesOneAboveTheOtherAreUpright) {
    const glm::dquat askew = glm::angleAxis(0.7, glm::normalize(glm::dvec3(1, 2, -1)));
    const glm::dvec3 up = askew * glm::dvec3(0, 1, 0);
    const auto above = [&](double from, double step, int pictures) {
        TurnModel model = turnedBy(0, pictures, {1, 0});
        for (int k = 0; k < pictures; ++k)
            model.worldFromCamera[static_cast<std::size_t>(k)] =
                askew * heldAt(170 + 0.3 * k, from + step * k, k % 2 == 0 ? 0.2 : -0.2);
        return model;
    };
    const double upright = std::cos(2 * kDegree);
    for (const TurnModel& model : {above(-30, 20, 4), above(-40, 10, 9), above(-70, 20, 8)}) {
        const std::vector<bool> oriented(model.known.size(), true);
        const UpOfTurn found = findUp(model, oriented);
        EXPECT_GT(glm::dot(found.up, up), upright);
        EXPECT_FALSE(found.byOwnTops);
    }
    // Where nobody says how they were held it is a guess.
    const UpOfTurn guessed = findUp(above(-30, 20, 4), {});
    EXPECT_GT(glm::dot(guessed.up, up), upright);
    EXPECT_TRUE(guessed.byOwnTops);
}

TEST(PictureLevel, PortraitsOnTheirSideAreTurnedWhereTheyGoAround) {
    TurnModel model = turnedBy(0, 12, {1, 0});
    for (int k = 0; k < 12; ++k)
        model.worldFromCamera[static_cast<std::size_t>(k)] = heldAt(30 * k, 2, 90);
    // Cameras without a sense of how they are held write the same into each.
    for (const bool oriented : {false, true}) {
        const UpOfTurn found = findUp(model, std::vector<bool>(12, oriented));
        EXPECT_GT(glm::dot(found.up, glm::dvec3(0, 1, 0)), std::cos(0.5 * kDegree)) << oriented;
        EXPECT_FALSE(found.byOwnTops);
    }
    // One of them tells nothing that the others do not.
    TurnModel few = turnedBy(0.4, 6, {1, 0});
    few.worldFromCamera[2] = few.worldFromCamera[2] * heldAt(0, 0, 90);
    const UpOfTurn found = findUp(few, {});
    EXPECT_GT(glm::dot(found.up, glm::dvec3(0, 1, 0)), std::cos(0.5 * kDegree));
    EXPECT_FALSE(found.byOwnTops);
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

TEST(PictureLevel, APictureOfTheZenithDoesNotMoveTheMiddle) {
    TurnModel model = withZenith(6, 30);
    const glm::dvec3 up(0, 1, 0);
    const auto yawAhead = [&](bool closed) {
        const glm::dvec3 middle = glm::inverse(levelTurn(model, up, closed)) * glm::dvec3(0, 0, -1);
        return std::atan2(-middle.x, -middle.z) / kDegree;
    };
    EXPECT_NEAR(yawAhead(false), 75, 1e-6);
    // Nor is it what a closed turn begins with.
    std::swap(model.worldFromCamera.front(), model.worldFromCamera.back());
    EXPECT_NEAR(yawAhead(true), 30, 1e-6);
    // By itself it counts.
    for (std::size_t k = 1; k < 7; ++k) model.known[k] = false;
    EXPECT_NEAR(yawAhead(false), -100, 1e-6);
}

}  // namespace stx::panorama
