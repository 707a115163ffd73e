// Background views are drawn where no other view shows a surface.

#include <gtest/gtest.h>

#include "lib/render/compose/behind.hpp"
#include "lib/render/factory.hpp"
#include "lib/render/scene/page_set.hpp"
#include "tests/wall_with_block.hpp"

namespace stx {
namespace {

using test::besideWall, test::kHeight, test::kWall, test::kWidth, test::wallColour,
    test::wallWithBackground, test::wallWithBlock;

Frame draw(const Bundle& bundle, RenderMode mode, Fill fill, const Camera& camera) {
    RenderSettings settings;
    settings.mode = mode;
    settings.fill = fill;
    Job job;
    auto renderer = makeRenderer(Backend::cpu, bundle, settings, -1, job);
    EXPECT_TRUE(renderer) << renderer.error().text();
    auto frame = (*renderer)->render(camera);
    EXPECT_TRUE(frame) << frame.error().text();
    return std::move(*frame);
}

/// Pixels beside the block, away from all borders, where the wall is that the block hid.
std::vector<std::size_t> uncovered() {
    const Camera camera = besideWall();
    const double off = camera.position.x * camera.fx;
    std::vector<std::size_t> list;
    for (int y = 10; y < kHeight - 4; ++y) {
        for (int x = 0; x < kWidth; ++x) {
            const double inView = x + 0.5 + off / kWall, ofBlock = x + 0.5 + off / 2.0;
            if (inView > 19 && inView < 29 && ofBlock > 31)
                list.push_back(static_cast<std::size_t>(y) * kWidth + static_cast<unsigned>(x));
        }
    }
    return list;
}

class BehindModes : public testing::TestWithParam<RenderMode> {};

TEST_P(BehindModes, WhatABlockHidesIsRemembered) {
    const Bundle bundle = wallWithBackground();
    const Frame open = draw(bundle, GetParam(), Fill::none, besideWall());
    const Frame drawn = draw(bundle, GetParam(), Fill::background, besideWall());
    Bundle wall;
    wall.views = {wallWithBlock(0, 0, 2.0f)};
    const Frame truth = draw(wall, GetParam(), Fill::none, besideWall());
    const auto holes = uncovered();
    ASSERT_GT(holes.size(), 40u);
    for (const std::size_t p : holes) {
        ASSERT_NEAR(drawn.colour.data()[p].a, 1.0f, 0.01f);
        ASSERT_NEAR(drawn.depth.data()[p], kWall, 0.01f);
        for (int c = 0; c < 3; ++c)
            ASSERT_NEAR(drawn.colour.data()[p][c], truth.colour.data()[p][c], 2.0f / 255);
    }
    // Nothing else changes: the block and the wall are what is seen now.
    for (int y = 10; y < kHeight - 2; ++y)
        for (int x = 2; x < 38; ++x)
            if (x < 11 || x > 22) {
                ASSERT_EQ(drawn.colour.at(x, y), open.colour.at(x, y)) << x << ' ' << y;
            }
}

TEST_P(BehindModes, ItIsLitAsTheViewIsNow) {
    const Bundle bundle = wallWithBackground(0.9f);
    const Frame drawn = draw(bundle, GetParam(), Fill::background, besideWall());
    Bundle wall;
    wall.views = {wallWithBlock(0, 0, 2.0f, 0.9f)};
    const Frame truth = draw(wall, GetParam(), Fill::none, besideWall());
    for (const std::size_t p : uncovered())
        for (int c = 0; c < 3; ++c)
            ASSERT_NEAR(drawn.colour.data()[p][c], truth.colour.data()[p][c], 2.0f / 255);
}

TEST_P(BehindModes, ABundleOfBackgroundsOnlyIsDrawn) {
    Bundle bundle = wallWithBackground();
    bundle.views.erase(bundle.views.begin());
    const Frame drawn = draw(bundle, GetParam(), Fill::none, besideWall());
    EXPECT_EQ(drawn.colour.at(kWidth / 2, kHeight / 2).a, 1.0f);
}

INSTANTIATE_TEST_SUITE_P(Both, BehindModes, testing::Values(RenderMode::surface, RenderMode::splat),
                         [](const auto& mode) {
                             return std::string(mode.param == RenderMode::splat ? "splat"
                                                                                : "surface");
                         });

TEST(Behind, AViewsOwnPictureIsItsOwn) {
    const Bundle bundle = wallWithBackground();
    const Frame drawn = draw(bundle, RenderMode::surface, Fill::background, bundle.views[0].camera);
    for (std::size_t p = 0; p < drawn.colour.count(); ++p)
        ASSERT_EQ(drawn.colour.data()[p], bundle.views[0].texture.at(p));
}

/// What is seen now is farther than what was remembered: that has gone.
TEST(Behind, WhatASourceSeesPastIsNotThereNow) {
    Bundle bundle;
    bundle.views = {wallWithBlock(0, 0, 2.0f), wallWithBlock(18, 30, 2.0f)};
    bundle.views[1].name = "behind";
    bundle.views[1].background = true;
    for (const RenderMode mode : {RenderMode::surface, RenderMode::splat}) {
        const Frame drawn = draw(bundle, mode, Fill::background, besideWall());
        for (int y = 10; y < kHeight - 2; ++y)
            for (int x = 2; x < 36; ++x)
                ASSERT_NEAR(drawn.depth.at(x, y), kWall, 0.01f) << x << ' ' << y;
    }
}

/// The block never left its place: its background is open there, and filled like that of a view
/// alone.
TEST(Behind, WhatWasNeverSeenIsFilledFromAround) {
    Bundle bundle = wallWithBackground();
    ReferenceView& wall = bundle.views[1];
    for (int y = 8; y < kHeight; ++y) {
        for (int x = 18; x < 30; ++x) {
            wall.depth.at(x, y) = kNoDepth;
            wall.texture.rgba8()->at(x, y) = glm::u8vec4(0);
        }
    }
    const Frame drawn = draw(bundle, RenderMode::surface, Fill::background, besideWall());
    for (const std::size_t p : uncovered()) {
        ASSERT_NEAR(drawn.colour.data()[p].a, 1.0f, 0.01f);
        ASSERT_NEAR(drawn.depth.data()[p], kWall, 0.1f);
    }
}

TEST(Behind, LiesUnderByWhatIsOpen) {
    Frame front, background;
    front.colour = Image<glm::vec4>(4, 1, glm::vec4(0.0f));
    front.depth = Image<float>(4, 1, kNoDepth);
    background.colour = Image<glm::vec4>(4, 1, glm::vec4(0, 1, 0, 1));
    background.depth = Image<float>(4, 1, 4.0f);
    front.colour.at(1, 0) = {0.25f, 0, 0, 0.25f};  // a rim of something near
    front.depth.at(1, 0) = 2;
    front.colour.at(2, 0) = {1, 0, 0, 1};  // farther than the background, which may stand there
    front.depth.at(2, 0) = 6;
    front.colour.at(3, 0) = {1, 0, 0, 1};  // the same where it may not
    front.depth.at(3, 0) = 6;
    putBehind(front, background, [](int x, int y, float depth) {
        EXPECT_EQ(y, 0);
        EXPECT_EQ(depth, 4.0f);
        return x == 2;
    });
    EXPECT_EQ(front.colour.at(0, 0), glm::vec4(0, 1, 0, 1));
    EXPECT_EQ(front.colour.at(1, 0), glm::vec4(0.25f, 0.75f, 0, 1));
    EXPECT_EQ(front.colour.at(2, 0), glm::vec4(0, 1, 0, 1));
    EXPECT_EQ(front.colour.at(3, 0), glm::vec4(1, 0, 0, 1));
    EXPECT_EQ(front.depth.at(0, 0), 4.0f);
    EXPECT_EQ(front.depth.at(1, 0), 4.0f);
    EXPECT_EQ(front.depth.at(2, 0), 4.0f);
    EXPECT_EQ(front.depth.at(3, 0), 6.0f);
}

}  // namespace
}  // namespace stx
