#include <gtest/gtest.h>

#include "lib/packing/packing.hpp"
#include "lib/render/factory.hpp"
#include "lib/render/scene/page_set.hpp"
#include "tests/torus_bundle.hpp"

namespace stx {
namespace {

class DistinctPages : public testing::Test {
  protected:
    static std::size_t kept(const Bundle& bundle) {
        return PageSet(bundle).distinct().views().size();
    }
    Image<glm::vec4> draw(const Bundle& bundle, RenderMode mode) {
        RenderSettings settings;
        settings.mode = mode;
        auto renderer = makeRenderer(Backend::cpu, bundle, settings, -1, job);
        EXPECT_TRUE(renderer) << renderer.error().text();
        Camera camera = views.views[0].camera;
        camera.position *= 1.2;
        auto frame = (*renderer)->render(camera);
        EXPECT_TRUE(frame) << frame.error().text();
        return frame->colour;
    }
    Job job;
    Bundle views = torusViews(64);
};

TEST_F(DistinctPages, AViewTwiceIsDrawnAsOnce) {
    Bundle twice = views;
    twice.views.insert(twice.views.begin() + 8, views.views[5]);
    ASSERT_EQ(kept(twice), views.views.size());
    for (const RenderMode mode : {RenderMode::surface, RenderMode::splat})
        EXPECT_EQ(draw(twice, mode), draw(views, mode));
}

/// Four cells in the middle, eight of the edges in pairs, four corners that are all the lower pole.
TEST_F(DistinctPages, AnOctahedralGridHasItsBorderTwice) {
    const Bundle grid = torusViews(48, glm::dvec3(0), {ViewLayout::Kind::octahedral, 4, 0});
    ASSERT_EQ(grid.views.size(), 16u);
    EXPECT_EQ(kept(grid), 4u + 4u + 1u);
    auto atlas = pack(grid, {}, job);
    ASSERT_TRUE(atlas);
    const auto set = PageSet::of(*atlas, job);
    ASSERT_TRUE(set);
    EXPECT_EQ(set->distinct().views().size(), 9u);
}

/// What is transparent in an atlas has the colours of what is beside it in the page.
TEST_F(DistinctPages, ColoursThatDoNotShowAreNotCompared) {
    const Bundle grid = torusViews(48, glm::dvec3(0), {ViewLayout::Kind::octahedral, 4, 0});
    auto atlas = pack(grid, {}, job);
    ASSERT_TRUE(atlas);
    for (AtlasPage& page : atlas->pages) {
        Rgba8Image& pixels = *page.texture.rgba8();
        for (std::size_t i = 0; i < pixels.count(); ++i)
            if (pixels.data()[i].a == 0)
                pixels.data()[i] = glm::u8vec4(i % 251, i % 241, i % 239, 0);
    }
    const auto set = PageSet::of(*atlas, job);
    ASSERT_TRUE(set);
    EXPECT_EQ(set->distinct().views().size(), 9u);
}

TEST_F(DistinctPages, AnotherPictureOfTheSameCameraStays) {
    Bundle more = views;
    more.views.push_back(more.views[0]);
    Image<float>& depth = more.views.back().depth;
    for (int y = 20; y < 40; ++y)
        for (int x = 20; x < 40; ++x) depth.at(x, y) *= 1.01f;
    EXPECT_EQ(kept(more), more.views.size());
}

/// A thousandth may differ, of 64x64 pixels four: it is counted no further than that.
TEST_F(DistinctPages, AFewPixelsMayDiffer) {
    Bundle more = views;
    more.views.push_back(more.views[0]);
    Image<float>& depth = more.views.back().depth;
    int changed = 0;
    for (std::size_t i = 0; i < depth.count() && changed < 5; ++i) {
        if (!hasPoint(depth.data()[i])) continue;
        depth.data()[i] *= 1.01f;
        EXPECT_EQ(kept(more), views.views.size() + (++changed > 4 ? 1 : 0)) << changed;
    }
    EXPECT_EQ(changed, 5);
}

}  // namespace
}  // namespace stx
