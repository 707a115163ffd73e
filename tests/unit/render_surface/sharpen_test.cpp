#include "lib/render/surface/prepare/sharpen.hpp"

#include <gtest/gtest.h>

namespace stx::surface {
namespace {

constexpr int kSize = 24;

/// A wall across the view, whose right part from `step` on is twice as far away.
ReferenceView wallWith(Texture texture, int step = kSize) {
    ReferenceView view;
    view.camera = Camera::fromFieldOfView({0, 0, 0}, {1, 0, 0, 0}, {1.0, 1.0}, false, kSize, kSize);
    view.depthBits = 32;
    view.depth = Image<float>(kSize, kSize, 1.0f);
    for (int y = 0; y < kSize; ++y)
        for (int x = step; x < kSize; ++x) view.depth.at(x, y) = 2.0f;
    view.nearPlane = 0.5;
    view.farPlane = 4;
    view.texture = std::move(texture);
    return view;
}

/// Grey everywhere, with one pixel that is brighter in red.
Rgba8Image greyWithSpot(int x, int y) {
    Rgba8Image image(kSize, kSize, glm::u8vec4(100, 100, 100, 255));
    image.at(x, y).r = 200;
    return image;
}

Rgba8Image sharpenedOf(const ReferenceView& view) {
    Bundle bundle;
    bundle.views = {view, view};
    const SurfaceScene scene(bundle);
    return *scene.pages[0].texture->rgba8();
}

TEST(Sharpen, APixelMovesAwayFromItsNeighbours) {
    const Rgba8Image out = sharpenedOf(wallWith(greyWithSpot(10, 12)));
    // 11/256 of the sum of four differences: 400 around the spot, 100 beside it.
    EXPECT_EQ(out.at(10, 12), glm::u8vec4(217, 100, 100, 255));
    for (const auto& [x, y] : {std::pair{9, 12}, {11, 12}, {10, 11}, {10, 13}})
        EXPECT_EQ(out.at(x, y), glm::u8vec4(96, 100, 100, 255)) << x << ", " << y;
    EXPECT_EQ(out.at(9, 11), glm::u8vec4(100, 100, 100, 255));
}

TEST(Sharpen, SlopesOfColourStayAsTheyAre) {
    Rgba8Image image(kSize, kSize);
    for (int y = 0; y < kSize; ++y)
        for (int x = 0; x < kSize; ++x) image.at(x, y) = {5 * x, 3 * y, 255 - 2 * x - 4 * y, 255};
    EXPECT_EQ(sharpenedOf(wallWith(image)), image);
}

TEST(Sharpen, NothingChangesBesideAnEdge) {
    // The edge is between columns 9 and 10: these, and those beside them, keep their colours.
    for (const int x : {8, 9, 10, 11})
        EXPECT_EQ(sharpenedOf(wallWith(greyWithSpot(x, 12), 10)).at(x, 12).r, 200) << x;
    for (const int x : {6, 13})
        EXPECT_EQ(sharpenedOf(wallWith(greyWithSpot(x, 12), 10)).at(x, 12).r, 217) << x;
}

TEST(Sharpen, ABrightLightLeavesNoBlackRing) {
    RgbaFloatImage image(kSize, kSize, glm::vec4(0.1f, 0.1f, 0.1f, 1.0f));
    image.at(10, 12) = {1000.0f, 0.1f, 0.1f, 1.0f};
    Bundle bundle;
    bundle.views = {wallWith(image), wallWith(image)};
    const SurfaceScene scene(bundle);
    const RgbaFloatImage& out = *scene.pages[0].texture->rgbaFloat();
    EXPECT_FLOAT_EQ(out.at(9, 12).r, 0.05f);
    EXPECT_FLOAT_EQ(out.at(9, 12).g, 0.1f);
    EXPECT_GT(out.at(10, 12).r, 1100.0f);
}

TEST(Sharpen, ViewsAloneAreReadAsTheyAre) {
    Bundle bundle;
    bundle.views = {wallWith(greyWithSpot(10, 12))};
    const SurfaceScene alone(bundle);
    EXPECT_EQ(alone.pages[0].texture, alone.set.pages()[0].texture);
}

}  // namespace
}  // namespace stx::surface
