// What a photograph hides, where little of what is behind is seen: narrow gaps, holes, no rim at
// all.

#include <cmath>
#include <functional>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "lib/background/behind_layer.hpp"
#include "lib/background/behind_photo.hpp"
#include "lib/background/membrane.hpp"

namespace stx {
namespace {

constexpr int kGapsWidth = 128, kGapsHeight = 96;
constexpr glm::u8vec3 kBehindGaps = {160, 120, 0}, kBeforeGaps = {20, 20, 250};

/// A photograph of these distances (kNoDepth: none): blue is what is nearer than `far`.
ReferenceView photoOfDistances(const std::function<float(int, int)>& distance, float far) {
    ReferenceView view;
    view.name = "photo";
    view.camera.width = kGapsWidth;
    view.camera.height = kGapsHeight;
    view.camera.fx = view.camera.fy = 150;
    view.camera.cx = kGapsWidth * 0.5;
    view.camera.cy = kGapsHeight * 0.5;
    view.nearPlane = 0.5f;
    view.farPlane = 8;
    view.depthBits = 32;
    view.depth = Image<float>(kGapsWidth, kGapsHeight);
    Rgba8Image colour(kGapsWidth, kGapsHeight);
    for (int y = 0; y < kGapsHeight; ++y) {
        for (int x = 0; x < kGapsWidth; ++x) {
            const float z = view.depth.at(x, y) = distance(x, y);
            colour.at(x, y) = glm::u8vec4(hasPoint(z) && z < far ? kBeforeGaps : kBehindGaps, 255);
        }
    }
    view.texture = std::move(colour);
    return view;
}

BehindPhoto inventedOf(const ReferenceView& view) {
    Job job;
    auto behind = behindPhoto(view, {8}, job);
    if (!behind) {
        ADD_FAILURE() << behind.error().text();
        return {};
    }
    return std::move(*behind);
}

}  // namespace

// All that is seen of the wall is within three pixels of something nearer.
TEST(BehindGaps, WhatShowsOnlyInNarrowGapsIsInvented) {
    const auto picket = [](int x) { return x % 18 < 12; };
    const BehindPhoto behind =
        inventedOf(photoOfDistances([&](int x, int) { return picket(x) ? 1.5f : 4.0f; }, 4));
    ASSERT_TRUE(behind.view.texture.rgba8());
    // Away from the frame, which what is around it reaches into.
    for (int y = 20; y < kGapsHeight - 20; ++y) {
        for (int x = 20; x < kGapsWidth - 20; ++x) {
            if (!picket(x)) continue;
            const glm::ivec2 at = glm::ivec2(x, y) + behind.border;
            EXPECT_NEAR(behind.view.depth.at(at.x, at.y), 4, 0.4) << x << ' ' << y;
            const glm::u8vec4 c = behind.view.texture.rgba8()->at(at.x, at.y);
            EXPECT_NEAR(c.r, kBehindGaps.r, 3) << x << ' ' << y;
            EXPECT_NEAR(c.b, kBehindGaps.b, 3) << x << ' ' << y;
        }
    }
}

// Nothing is behind the wall, all of which is beside such a hole.
TEST(BehindGaps, EmptyHolesInTheWallTakeNothingAwayBehindACard) {
    const auto isCard = [](int x, int y) { return std::abs(x - 64) < 20 && std::abs(y - 48) < 20; };
    const auto distance = [&](int x, int y) {
        if (isCard(x, y)) return 1.0f;
        return x % 6 == 0 && y % 6 == 0 ? kNoDepth : 2.0f;
    };
    ReferenceView photo = photoOfDistances(distance, 2);
    photo.noDepth = NoDepth::empty;
    const BehindPhoto behind = inventedOf(photo);
    ASSERT_TRUE(behind.view.texture.rgba8());
    for (int y = 20; y < kGapsHeight - 20; ++y) {
        for (int x = 20; x < kGapsWidth - 20; ++x) {
            const bool within =
                isCard(x - 4, y) && isCard(x + 4, y) && isCard(x, y - 4) && isCard(x, y + 4);
            if (!isCard(x, y) || within) continue;
            const glm::ivec2 at = glm::ivec2(x, y) + behind.border;
            EXPECT_NEAR(behind.view.depth.at(at.x, at.y), 2, 0.05) << x << ' ' << y;
            EXPECT_NEAR(behind.view.texture.rgba8()->at(at.x, at.y).b, 0, 3) << x << ' ' << y;
        }
    }
}

TEST(BehindGaps, UnknownPixelsAtTheFrameMakeNoHolesInTheBorder) {
    const auto distance = [](int x, int y) {
        const bool acrossRim = y == 0 || y == kGapsHeight - 1;
        const bool downRim = x == 0 || x == kGapsWidth - 1;
        return (acrossRim && x % 5 == 2) || (downRim && y % 5 == 2) ? kNoDepth : 2.0f;
    };
    ReferenceView photo = photoOfDistances(distance, 2);
    photo.noDepth = NoDepth::unknown;
    const BehindPhoto behind = inventedOf(photo);
    ASSERT_GT(behind.border.x, 4);
    ASSERT_GT(behind.border.y, 4);
    for (int y = 0; y < behind.view.depth.height(); ++y) {
        for (int x = 0; x < behind.view.depth.width(); ++x) {
            if (photo.depth.contains(x - behind.border.x, y - behind.border.y)) continue;
            EXPECT_NEAR(behind.view.depth.at(x, y), 2, 1e-3) << x << ' ' << y;
        }
    }
}

TEST(BehindGaps, WhatNoKnownValueReachesKeepsItsFirstGuess) {
    behind::Membrane<float> membrane;
    // Four in a row: the third is beside a known value, which reaches the fourth; the first two are
    // linked to each other alone.
    membrane.add({{1, -1, -1, -1}, 0, 1}, 0.0f, false);
    membrane.add({{-1, 0, -1, -1}, 0, 1}, 1.0f, true);
    membrane.add({{3, -1, -1, -1}, 5, 2}, 0.0f, false);
    membrane.add({{-1, 2, -1, -1}, 0, 1}, 1.0f, true);
    membrane.solve(120, 1.93f);
    EXPECT_EQ(membrane.values[0], 0);
    EXPECT_EQ(membrane.values[1], 1);
    EXPECT_NEAR(membrane.values[2], 5, 0.05);
    EXPECT_NEAR(membrane.values[3], 5, 0.05);
}

TEST(BehindGaps, ColoursThatBeginWithFartherOnesStayBetweenThem) {
    // Four hidden blocks in a row; all that is beside them is much farther away than they are.
    behind::Layer layer;
    layer.photo = {6, 3};
    layer.part = Image<behind::Part>(6, 3, behind::Part::shown);
    layer.front = layer.far = Image<float>(6, 3, 1.0f);
    layer.parallax = Image<float>(6, 3, behind::kNoParallax);
    layer.shown = layer.colour = Image<glm::vec3>(6, 3, glm::vec3(0));
    for (int y = 0; y < 3; ++y)
        for (int x = 0; x < 6; ++x) layer.shown.at(x, y) = glm::vec3(x < 2 ? 0.4f : 0.6f);
    for (int x = 1; x < 5; ++x) {
        layer.part.at(x, 1) = behind::Part::hidden;
        layer.front.at(x, 1) = layer.far.at(x, 1) = 8;
        layer.parallax.at(x, 1) = 5;
    }
    behind::inventColour(layer);
    for (int x = 1; x < 5; ++x) {
        EXPECT_EQ(layer.part.at(x, 1), behind::Part::hidden);
        EXPECT_GE(layer.colour.at(x, 1).g, 0.399f) << x;
        EXPECT_LE(layer.colour.at(x, 1).g, 0.601f) << x;
    }
}

TEST(BehindGaps, TheNoteCountsWholePercentsFrom10On) {
    const auto noteOf = [](double share) {
        AddedBehind added;
        added.hidden = share;
        return added.note({8});
    };
    const auto says = [&](double share, const char* percent) {
        const std::string part = std::string("invented: ") + percent + " % of its pixels";
        return noteOf(share).find(part) != std::string::npos;
    };
    EXPECT_TRUE(says(1.0, "100")) << noteOf(1.0);
    EXPECT_TRUE(says(0.994, "99")) << noteOf(0.994);
    EXPECT_TRUE(says(0.0999, "10")) << noteOf(0.0999);
    EXPECT_TRUE(says(0.0651, "6.5")) << noteOf(0.0651);
    EXPECT_TRUE(says(0, "0")) << noteOf(0);
}

}  // namespace stx
