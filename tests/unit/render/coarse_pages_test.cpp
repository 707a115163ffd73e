#include <gtest/gtest.h>

#include "lib/packing/packing.hpp"
#include "lib/render/bench/analytic_scene.hpp"
#include "lib/render/factory.hpp"
#include "lib/render/scene/page_set.hpp"

namespace stx {
namespace {

constexpr int kViews = 8;

ReferenceView viewOf(double number, int side) {
    return viewOfAnalyticScene(
        AnalyticScene::object,
        analyticCamera(AnalyticScene::object, number, kViews).resized(side, side), 2);
}

Bundle fineViews() {
    Bundle bundle;
    for (int i = 0; i < kViews; ++i) bundle.views.push_back(viewOf(i, 96));
    return bundle;
}

Image<glm::vec4> draw(const Bundle& bundle) {
    Job job;
    RenderSettings settings;
    settings.mode = RenderMode::splat;
    const auto renderer = makeRenderer(Backend::cpu, bundle, settings, -1, job);
    EXPECT_TRUE(renderer);
    return (*renderer)
        ->render(analyticCamera(AnalyticScene::object, 0.5, kViews).resized(120, 120))
        ->colour;
}

/// Its splats are as large as 64 of the others', and stuck out beyond the outline: 17 instead of 35
/// dB with a view of one pixel, 27 instead of 34 with one from far away.
TEST(CoarsePages, AViewOfFewPixelsChangesNothing) {
    for (const int side : {1, 12}) {
        Bundle mixed = fineViews();
        mixed.views.insert(mixed.views.begin() + 3, viewOf(2.2, side));
        EXPECT_TRUE(draw(mixed) == draw(fineViews())) << side;
    }
}

TEST(CoarsePages, WhatOnlyACoarseViewShowsStays) {
    std::int64_t points = 0;
    Bundle apart;
    apart.views = {viewOf(0, 96), viewOf(kViews / 2, 12)};  // from the other side
    const PageSet set(apart);
    EXPECT_EQ(set.withoutCoarse(points).views().size(), 2u);
    EXPECT_LT(points, set.pointCount() / 100);
    // Views as fine as each other are left as they are.
    const Bundle same = fineViews();
    const PageSet fine(same);
    EXPECT_EQ(fine.withoutCoarse(points).pages().data(), fine.pages().data());
    EXPECT_EQ(points, 0);
}

/// In an atlas, too, where views are rectangles.
TEST(CoarsePages, AreLeftOutOfAtlases) {
    Job job;
    Bundle mixed = fineViews();
    mixed.views.push_back(viewOf(2.2, 12));
    const auto atlas = pack(mixed, {.layout = PackSettings::Layout::tight}, job);
    ASSERT_TRUE(atlas);
    const auto set = PageSet::of(*atlas, job);
    ASSERT_TRUE(set);
    std::int64_t points = 0;
    EXPECT_EQ(set->withoutCoarse(points).views().size(), fineViews().views.size());
    EXPECT_EQ(points, mixed.views.back().pointCount());
}

}  // namespace
}  // namespace stx
