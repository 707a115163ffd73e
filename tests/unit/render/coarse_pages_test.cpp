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

/// However little it is: what fine views lack within one pixel of the coarse one, amid its surface.
/// A steep view's neighbours lie far from each other, but beyond the pixel.
TEST(CoarsePages, AHoleOfOnePixelIsShown) {
    const ReferenceView coarse = viewOf(2.2, 20);
    const auto shown = [&](int x, int y) { return hasPoint(coarse.depth.at(x, y)); };
    const auto place = [&](const ReferenceView& view, int x, int y) {
        const Camera& camera = coarse.camera;
        return glm::dvec2(camera.project(glm::conjugate(camera.orientation) *
                                         (view.worldPoint(x, y) - camera.position)));
    };
    int holes = 0;
    for (int y = 1; y < 19; ++y) {
        for (int x = 1; x < 19; ++x) {
            if (!shown(x, y) || !shown(x - 1, y) || !shown(x + 1, y) || !shown(x, y - 1) ||
                !shown(x, y + 1))
                continue;
            ++holes;
            Bundle most = fineViews();
            for (ReferenceView& view : most.views)
                for (int v = 0; v < view.depth.height(); ++v)
                    for (int u = 0; u < view.depth.width(); ++u)
                        if (hasPoint(view.depth.at(u, v)) &&
                            glm::all(glm::lessThan(
                                glm::abs(place(view, u, v) - glm::dvec2(x + 0.5, y + 0.5)),
                                glm::dvec2(0.51))))
                            view.depth.at(u, v) = kNoDepth;
            most.views.push_back(coarse);
            std::int64_t points = 0;
            const PageSet left = PageSet(most).withoutCoarse(points);
            EXPECT_GT(points, coarse.pointCount() / 2);
            ASSERT_EQ(left.views().size(), most.views.size()) << x << ' ' << y;
            EXPECT_TRUE(hasPoint(left.depth(kViews, x, y))) << x << ' ' << y;
        }
    }
    EXPECT_GT(holes, 5);
}

/// A sheet without thickness: fine views of its back do not show its front.
TEST(CoarsePages, TheFrontOfASheetStays) {
    Bundle sheet;
    for (const auto& [side, z] : {std::pair{96, -3.0}, std::pair{12, 3.0}}) {
        ReferenceView& view = sheet.views.emplace_back();
        view.name = z > 0 ? "front" : "back";
        view.camera = Camera::fromFieldOfView({0, 0, z}, *lookAt({0, 0, z}, {0, 0, 0}),
                                              glm::dvec2(0.5), false, side, side);
        view.nearPlane = 2.9;
        view.farPlane = 3.1;
        view.texture = Rgba8Image(side, side, glm::u8vec4(255));
        view.depth = Image<float>(side, side, 3.0f);
    }
    std::int64_t points = 0;
    const PageSet set(sheet);
    EXPECT_EQ(set.withoutCoarse(points).views().size(), 2u);
    EXPECT_EQ(points, 0);
    // From the same side they do.
    sheet.views[0].camera = sheet.views[1].camera.resized(96, 96);
    const PageSet front(sheet);
    EXPECT_EQ(front.withoutCoarse(points).views().size(), 1u);
    EXPECT_EQ(points, 144);
}

/// In an atlas, too, where views are rectangles.
TEST(CoarsePages, AreLeftOutOfAtlases) {
    Job job;
    Bundle mixed = fineViews();
    mixed.views.push_back(viewOf(2.2, 12));
    PackSettings tight;
    tight.layout = PackSettings::Layout::tight;
    const auto atlas = pack(mixed, tight, job);
    ASSERT_TRUE(atlas);
    const auto set = PageSet::of(*atlas, job);
    ASSERT_TRUE(set);
    std::int64_t points = 0;
    EXPECT_EQ(set->withoutCoarse(points).views().size(), fineViews().views.size());
    EXPECT_EQ(points, mixed.views.back().pointCount());
}

/// Beyond the border of a view lies nothing of it: packed, what was read there is in no page, and
/// it crashed.
TEST(CoarsePages, TheBorderOfAViewHasNeighboursOnOneSide) {
    Bundle walls;
    for (const auto& [side, lens] : {std::pair{64, 64.0}, std::pair{128, 256.0}}) {
        ReferenceView& view = walls.views.emplace_back();
        view.name = fmt::format("{}", side);
        view.camera.position = {0, 0, 4};
        view.camera.width = view.camera.height = side;
        view.camera.fx = view.camera.fy = lens;
        view.camera.cx = view.camera.cy = side / 2.0;
        view.nearPlane = 3.9;
        view.farPlane = 4.1;
        view.texture = Rgba8Image(side, side, glm::u8vec4(255));
        view.depth = Image<float>(side, side, 4.0f);
    }
    // The fine view shows the middle half of the other.
    constexpr std::int64_t kShown = 32 * 32;
    std::int64_t points = 0;
    EXPECT_EQ(PageSet(walls).withoutCoarse(points).views().size(), 2u);
    EXPECT_EQ(points, kShown);
    Job job;
    const auto atlas = pack(walls, {}, job);
    ASSERT_TRUE(atlas);
    const auto set = PageSet::of(*atlas, job);
    ASSERT_TRUE(set);
    EXPECT_EQ(set->withoutCoarse(points).views().size(), 2u);
    EXPECT_EQ(points, kShown);
}

}  // namespace
}  // namespace stx
