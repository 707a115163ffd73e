// Rectangles on one page, from below.

#include "lib/packing/skyline.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

#include "lib/base/image.hpp"

namespace stx {
namespace {

/// Groups of one rectangle each.
std::vector<RectangleGroup> groupsOf(const std::vector<glm::ivec2>& sizes) {
    std::vector<RectangleGroup> groups;
    for (const glm::ivec2 size : sizes)
        groups.push_back({size.x, size.y, {static_cast<int>(groups.size())}});
    return groups;
}

struct PackedPage {
    int height = 0;
    std::vector<int> left;
    std::vector<SkylinePlace> places;
};

PackedPage fillPage(const std::vector<RectangleGroup>& groups, int width, int maxHeight,
                    GapRule rule, bool mayTurn = false, int giveUpAbove = 1 << 30) {
    std::vector<int> order(groups.size());
    std::iota(order.begin(), order.end(), 0);
    PackedPage page;
    for (const auto& group : groups) page.left.push_back(static_cast<int>(group.members.size()));
    page.height = Skyline(groups).fill(width, maxHeight, order, rule, mayTurn, giveUpAbove,
                                       page.left, &page.places);
    return page;
}

}  // namespace

TEST(Skyline, PlacesAreInsideThePageAndApart) {
    std::mt19937 random(3);
    for (const GapRule rule : {GapRule::firstFit, GapRule::avoidWaste, GapRule::widest}) {
        std::vector<RectangleGroup> groups;
        int next = 0;
        for (int g = 0; g < 30; ++g) {
            RectangleGroup group{
                static_cast<int>(3 + random() % 40), static_cast<int>(3 + random() % 40), {}};
            for (unsigned n = random() % 4 + 1; n > 0; --n) group.members.push_back(next++);
            groups.push_back(group);
        }
        const PackedPage page = fillPage(groups, 100, 150, rule, true);
        Image<int> owner(100, 150, -1);
        std::vector<int> placed(groups.size(), 0);
        int top = 0;
        for (std::size_t i = 0; i < page.places.size(); ++i) {
            const SkylinePlace& place = page.places[i];
            const RectangleGroup& group = groups[static_cast<std::size_t>(place.group)];
            ++placed[static_cast<std::size_t>(place.group)];
            const int w = place.turned ? group.height : group.width;
            const int h = place.turned ? group.width : group.height;
            ASSERT_TRUE(place.x >= 0 && place.y >= 0 && place.x + w <= 100 && place.y + h <= 150);
            for (int y = place.y; y < place.y + h; ++y)
                for (int x = place.x; x < place.x + w; ++x) {
                    ASSERT_EQ(owner.at(x, y), -1) << x << ' ' << y;
                    owner.at(x, y) = static_cast<int>(i);
                }
            top = std::max(top, place.y + h);
        }
        EXPECT_EQ(page.height, top);
        for (std::size_t g = 0; g < groups.size(); ++g)
            EXPECT_EQ(placed[g] + page.left[g], static_cast<int>(groups[g].members.size()));
        // The page is full: of 15000 pixels, nine of ten are used.
        EXPECT_GT(100 * 150 - std::count(owner.pixels().begin(), owner.pixels().end(), -1), 13500);
    }
}

TEST(Skyline, WhatFitsExactlyLeavesNoGap) {
    // 40 + 60 wide below, 100 above; the order would put the 50 first.
    const auto groups = groupsOf({{40, 20}, {50, 20}, {60, 20}, {100, 10}});
    const PackedPage page = fillPage(groups, 100, 30, GapRule::firstFit);
    EXPECT_EQ(page.height, 30);
    EXPECT_EQ(page.left, (std::vector{0, 1, 0, 0}));
}

TEST(Skyline, TurnsRectanglesOnlyWhereItMay) {
    const auto groups = groupsOf({{20, 90}, {20, 90}});
    EXPECT_EQ(fillPage(groups, 90, 60, GapRule::firstFit, false).left, (std::vector{1, 1}));
    const PackedPage turned = fillPage(groups, 90, 60, GapRule::firstFit, true);
    EXPECT_EQ(turned.left, (std::vector{0, 0}));
    EXPECT_EQ(turned.height, 40);
    EXPECT_TRUE(turned.places[0].turned && turned.places[1].turned);
}

TEST(Skyline, TheWidestComesFirstWhereThatIsTheRule) {
    const auto groups = groupsOf({{30, 10}, {70, 10}, {70, 20}});
    EXPECT_EQ(fillPage(groups, 100, 100, GapRule::firstFit).places[0].group, 0);
    EXPECT_EQ(fillPage(groups, 100, 100, GapRule::widest).places[0].group, 2)
        << "of two of one width, the higher";
}

TEST(Skyline, GivesUpOnceThePageIsTooHigh) {
    const auto groups = groupsOf({{100, 40}, {100, 40}, {100, 40}});
    const PackedPage page = fillPage(groups, 100, 1000, GapRule::firstFit, false, 50);
    EXPECT_GT(page.height, 50);
    EXPECT_EQ(page.left[2], 1) << "it went on";
    EXPECT_EQ(fillPage(groups, 100, 1000, GapRule::firstFit, false, 120).height, 120);
}

}  // namespace stx
