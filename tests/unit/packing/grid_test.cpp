#include <gtest/gtest.h>

#include "lib/packing/packing.hpp"

namespace stx {
namespace {

Bundle whiteViews(int count, int width, int height) {
    Bundle bundle;
    for (int i = 0; i < count; ++i) {
        ReferenceView v;
        v.name = fmt::format("v{}", i);
        v.camera =
            Camera::fromFieldOfView({0, 0, 10}, {1, 0, 0, 0}, {0.8, 0.8}, false, width, height);
        v.depth = Image<float>(width, height, 20.0f + static_cast<float>(i));
        v.texture = Rgba8Image(width, height, glm::u8vec4(i, 2, 3, 255));
        bundle.views.push_back(std::move(v));
    }
    return bundle;
}

TEST(Grid, SixteenViewsOf256BecomeOne1024AsInThePaper) {
    PackSettings settings;
    settings.padding = 0;
    Job job;
    const auto atlas = pack(whiteViews(16, 256, 256), settings, job);
    ASSERT_TRUE(atlas);
    EXPECT_EQ(atlas->width(), 1024);
    EXPECT_EQ(atlas->height(), 1024);
    EXPECT_EQ(atlas->textureCount(), 2);
    EXPECT_DOUBLE_EQ(atlas->used(), 1.0);
    EXPECT_EQ(atlas->layout, "grid");
    for (int i = 0; i < 16; ++i) {
        EXPECT_EQ(atlas->rectangles[i].view, i);
        EXPECT_EQ(atlas->rectangles[i].atlasX, i % 4 * 256);
        EXPECT_EQ(atlas->rectangles[i].atlasY, i / 4 * 256);
    }
}

TEST(Grid, OctahedralGridsKeepTheirColumns) {
    PackSettings settings;
    Job job;
    const auto atlas = pack(whiteViews(64, 20, 12), settings, job);
    ASSERT_TRUE(atlas);
    EXPECT_EQ(atlas->width(), 8 * 24);
    EXPECT_EQ(atlas->height(), 8 * 16);
    EXPECT_EQ(atlas->rectangles[10].atlasX, 2 * 24 + 2);
    EXPECT_EQ(atlas->rectangles[10].atlasY, 1 * 16 + 2);
}

TEST(Grid, PaddingRepeatsTheEdge) {
    Bundle bundle = whiteViews(1, 3, 3);
    bundle.views[0].texture.rgba8()->at(0, 0) = {9, 9, 9, 255};
    PackSettings settings;
    settings.padding = 3;
    Job job;
    const auto atlas = pack(bundle, settings, job);
    ASSERT_TRUE(atlas);
    EXPECT_EQ(atlas->pages[0].texture.rgba8()->at(0, 0), glm::u8vec4(9, 9, 9, 255));
    EXPECT_EQ(atlas->pages[0].texture.rgba8()->at(3, 2), glm::u8vec4(9, 9, 9, 255));
    EXPECT_EQ(atlas->pages[0].texture.rgba8()->at(4, 2), glm::u8vec4(0, 2, 3, 255));
    EXPECT_EQ(atlas->pages[0].depth.at(8, 8), 20.0f);
}

/// An OpenEXR file of another program without alpha: all is covered, not all has a depth.
TEST(Grid, ViewsThatASensorMissedInPartsComeBackAsSuch) {
    Bundle bundle = whiteViews(2, 24, 20);
    for (int x = 0; x < 24; ++x) bundle.views[1].depth.at(x, 7) = kNoDepth;
    bundle.views[0].pruned = true;
    bundle.views[0].depth.at(3, 3) = kNoDepth;
    for (const auto layout : {PackSettings::Layout::grid, PackSettings::Layout::tight}) {
        PackSettings settings;
        settings.layout = layout;
        Job job;
        const auto atlas = pack(bundle, settings, job);
        ASSERT_TRUE(atlas);
        const auto back = unpack(*atlas, job);
        ASSERT_TRUE(back);
        EXPECT_TRUE(back->views[0].pruned);
        EXPECT_FALSE(back->views[1].pruned) << "nobody pruned it";
        EXPECT_EQ(back->views[1].texture.at(5, 7).a, 1.0f);
    }
}

/// What is read around a rectangle must be its view's: nothing beyond the view, padding elsewhere.
TEST(Grid, WholeViewsNeedNoPadding) {
    PackSettings settings;
    settings.padding = 0;
    Job job;
    Bundle bundle = whiteViews(4, 24, 20);
    const auto whole = pack(bundle, settings, job);
    ASSERT_TRUE(whole);
    EXPECT_TRUE(whole->paddingHolds(2));
    // Two parts of a view and a third in the middle that fits in no other way.
    for (auto& view : bundle.views)
        for (int y = 0; y < 20; ++y)
            for (int x = 0; x < 24; ++x)
                if (x + y < 20) {
                    view.depth.at(x, y) = kNoDepth;
                    view.texture.rgba8()->at(x, y).a = 0;
                }
    settings.layout = PackSettings::Layout::tight;
    const auto narrow = pack(bundle, settings, job);
    ASSERT_TRUE(narrow);
    EXPECT_FALSE(narrow->paddingHolds(2));
    settings.padding = 2;
    const auto wide = pack(bundle, settings, job);
    ASSERT_TRUE(wide);
    EXPECT_TRUE(wide->paddingHolds(2));
}

TEST(Grid, ATextureAtTheExactLimitFits) {
    PackSettings settings;
    settings.padding = 2;
    settings.maxSize = 4 * 68;
    Job job;
    const auto atlas = pack(whiteViews(16, 64, 64), settings, job);
    ASSERT_TRUE(atlas);
    EXPECT_EQ(atlas->width(), 272);
    EXPECT_EQ(atlas->pages.size(), 1u);
}

TEST(Grid, NarrowTexturesTakeMoreRowsThenMorePages) {
    PackSettings settings;
    settings.padding = 0;
    settings.maxSize = 64;
    Job job;
    const auto tall = pack(whiteViews(6, 32, 8), settings, job);  // 3 columns would be 96 wide
    ASSERT_TRUE(tall);
    EXPECT_EQ(tall->width(), 64);
    EXPECT_EQ(tall->height(), 24);
    const auto pages = pack(whiteViews(30, 32, 8), settings, job);  // 16 fit on a page
    ASSERT_TRUE(pages);
    EXPECT_EQ(pages->pages.size(), 2u);
    EXPECT_EQ(pages->textureCount(), 4);
    EXPECT_TRUE(pages->check());
}

TEST(Grid, PowersOfTwoAreTheSmallestThatHoldAll) {
    PackSettings settings;
    settings.powerOfTwo = true;
    Job job;
    const auto sizeOf = [&](int views, int width, int height) {
        const auto atlas = pack(whiteViews(views, width, height), settings, job);
        EXPECT_TRUE(atlas && atlas->check());
        return atlas ? glm::ivec2(atlas->width(), atlas->height()) : glm::ivec2(0);
    };
    // 2x2 cells would take twice as much; of equal areas the squarest.
    EXPECT_EQ(sizeOf(3, 126, 126), glm::ivec2(512, 256));
    EXPECT_EQ(sizeOf(4, 126, 126), glm::ivec2(512, 512));
    EXPECT_EQ(sizeOf(4, 124, 124), glm::ivec2(256, 256));
    EXPECT_EQ(sizeOf(1, 1000, 20), glm::ivec2(1024, 32));
    EXPECT_EQ(sizeOf(3, 20, 250), glm::ivec2(128, 256));
    settings.maxSize = 300;
    EXPECT_EQ(sizeOf(3, 100, 126), glm::ivec2(256, 256)) << "on two pages of two and one";
}

TEST(Grid, SaysWhatWouldBeNeededWhenViewsCannotFit) {
    PackSettings settings;
    settings.padding = 0;
    settings.maxSize = 1024;
    Job job;
    Bundle bundle = whiteViews(9, 512, 512);
    for (auto& v : bundle.views) v.normal = Image<glm::vec3>(512, 512, glm::vec3(0, 0, 1));
    const auto atlas = pack(bundle, settings, job);
    ASSERT_FALSE(atlas);
    EXPECT_EQ(
        atlas.error().message,
        "9 views of 512x512 with 0 pixels of padding need a grid of 1536x1536, but textures are at "
        "most 1024x1024; use the tight layout, fewer or smaller views, or larger textures "
        "(--max-size)");
}

TEST(Grid, RefusesNonsense) {
    Job job;
    PackSettings settings;
    settings.padding = -1;
    EXPECT_FALSE(pack(whiteViews(1, 4, 4), settings, job));
    settings.padding = 2;
    settings.maxSize = 0;
    EXPECT_FALSE(pack(whiteViews(1, 4, 4), settings, job));
    EXPECT_FALSE(pack(Bundle{}, {}, job));
    job.limits.maxMemoryBytes = 100;
    EXPECT_FALSE(pack(whiteViews(4, 64, 64), {}, job));
}

TEST(Atlas, CheckFindsOverlapAndExcess) {
    Job job;
    auto atlas = pack(whiteViews(4, 16, 16), {}, job);
    ASSERT_TRUE(atlas);
    EXPECT_TRUE(atlas->check());
    auto broken = *atlas;
    broken.rectangles[3].atlasX -= 5;
    EXPECT_FALSE(broken.check());
    broken = *atlas;
    broken.rectangles[1].width = 17;
    EXPECT_FALSE(broken.check());
    broken = *atlas;
    broken.rectangles[1].atlasY = 2147483640;
    EXPECT_FALSE(broken.check());
    broken = *atlas;
    broken.rectangles[2].page = 1;
    EXPECT_FALSE(broken.check());
    broken = *atlas;
    broken.rectangles[2].view = -1;
    EXPECT_FALSE(broken.check());
    EXPECT_FALSE(unpack(broken, job));
    broken = *atlas;
    broken.pages.resize(3, broken.pages[0]);
    EXPECT_FALSE(broken.check());
}

}  // namespace
}  // namespace stx
