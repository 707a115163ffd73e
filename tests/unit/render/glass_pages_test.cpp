#include "lib/render/scene/glass_pages.hpp"

#include <gtest/gtest.h>

namespace stx {
namespace {

/// Background, a column that glass covers a third of, glass of alpha 60 up to column 15, opaque.
ReferenceView paneBesideAWall(bool floats) {
    constexpr int kSide = 24;
    ReferenceView view;
    view.camera = Camera::fromFieldOfView({0, 0, 2}, {1, 0, 0, 0}, {0.5, 0.5}, false, kSide, kSide);
    Rgba8Image image(kSide, kSide, glm::u8vec4(10, 20, 30, 255));
    view.depth = Image<float>(kSide, kSide, 2.0f);
    for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < 16; ++x) image.at(x, y).a = x < 3 ? 0 : x == 3 ? 20 : 60;
        for (int x = 0; x < 3; ++x) view.depth.at(x, y) = kNoDepth;
    }
    view.texture = Texture(image);
    if (floats) {
        RgbaFloatImage linear(kSide, kSide);
        for (std::size_t i = 0; i < linear.count(); ++i) linear.data()[i] = view.texture.at(i);
        view.texture = Texture(std::move(linear));
    }
    view.nearPlane = 1.9;
    view.farPlane = 2.1;
    return view;
}

TEST(GlassPages, AlphaIsNotCoverageInGlass) {
    for (const bool floats : {false, true}) {
        Bundle bundle;
        bundle.views.push_back(paneBesideAWall(floats));
        const GlassPages pages{PageSet(bundle)};
        ASSERT_FALSE(pages.none());
        const auto at = [&](std::size_t x, std::size_t y) { return pages.coverage(0, 24 * y + x); };
        for (std::size_t y = 0; y < 24; ++y) {
            EXPECT_EQ(at(2, y), 0) << "background";
            EXPECT_EQ(at(3, y), 85) << "a third of a pixel";
            for (std::size_t x = 4; x < 16; ++x) EXPECT_EQ(at(x, y), 255) << x << " " << y;
            EXPECT_EQ(at(16, y), 0) << "opaque";
        }
    }
}

/// Pixels that an object covers in part are narrower than glass.
TEST(GlassPages, AnOutlineIsNoGlass) {
    Bundle bundle;
    bundle.views.push_back(paneBesideAWall(false));
    auto& pixels = *bundle.views[0].texture.rgba8();
    for (int y = 0; y < 24; ++y)
        for (int x = 7; x < 16; ++x) pixels.at(x, y).a = 255;
    const GlassPages pages{PageSet(bundle)};
    EXPECT_TRUE(pages.none() && pages.none(0));
    EXPECT_EQ(pages.coverage(0, 5), 0);
}

}  // namespace
}  // namespace stx
