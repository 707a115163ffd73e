// How far views disagree, by how much they were made to; and whom the note names.

#include "lib/registration/disagreement.hpp"

#include <mutex>
#include <tuple>

#include <gtest/gtest.h>

#include "lib/base/parallel.hpp"
#include "lib/registration/disagreement_by_view.hpp"
#include "lib/render/bench/analytic_scene.hpp"

namespace stx {
namespace {

constexpr int kViews = 5;
constexpr std::size_t kWrong = 3;

Bundle exactViews(AnalyticScene scene) {
    Bundle bundle;
    for (int i = 0; i < kViews; ++i) {
        bundle.views.push_back(
            viewOfAnalyticScene(scene, analyticCamera(scene, i, kViews).resized(200, 150), 1));
        bundle.views.back().name = "view" + std::to_string(i);
    }
    return bundle;
}

TEST(DepthDisagreement, ExactViewsAgree) {
    for (const AnalyticScene scene : {AnalyticScene::room, AnalyticScene::object}) {
        const Bundle bundle = exactViews(scene);
        const DepthDisagreement found = measureDepthDisagreement(bundle);
        ASSERT_EQ(found.views.size(), bundle.views.size());
        EXPECT_GT(found.pairs, 0);
        EXPECT_LT(found.relative, 0.0003);
        EXPECT_FALSE(found.disagrees());
        EXPECT_FALSE(disagreementNote(bundle, found, false));
    }
}

TEST(DepthDisagreement, IsTheOffsetThatAViewHas) {
    Bundle bundle = exactViews(AnalyticScene::room);
    for (float& depth : bundle.views[kWrong].depth.pixels()) depth *= 1.02f;
    const DepthDisagreement found = measureDepthDisagreement(bundle);
    for (std::size_t v = 0; v < bundle.views.size(); ++v) {
        const ViewDisagreement& view = found.views[v];
        EXPECT_EQ(view.partners, kViews - 1) << v;
        EXPECT_EQ(view.disagrees(), v == kWrong) << v;
        EXPECT_NEAR(view.relative, v == kWrong ? 0.02 : 0.0, 0.003) << v;
        if (v == kWrong) continue;
        EXPECT_EQ(view.farthest, static_cast<int>(kWrong)) << v;
        EXPECT_NEAR(view.farthestBy, 0.02, 0.003) << v;
    }
    const auto note = disagreementNote(bundle, found, false);
    ASSERT_TRUE(note);
    EXPECT_NE(note->find("1 of 5 views disagrees"), std::string::npos) << *note;
    EXPECT_NE(note->find("'view3' by"), std::string::npos) << *note;
    EXPECT_NE(note->find("stx refine --with poses"), std::string::npos) << *note;
    const auto aligned = disagreementNote(bundle, found, true);
    ASSERT_TRUE(aligned);
    EXPECT_EQ(aligned->find("--with poses"), std::string::npos) << *aligned;
}

/// Errors so large that no points are common: they were taken for things in front and behind.
TEST(DepthDisagreement, FindsDepthThatIsFarOff) {
    for (const float by : {0.8f, 1.15f, 1.3f, 2.0f}) {
        SCOPED_TRACE(by);
        Bundle bundle = exactViews(AnalyticScene::room);
        for (float& depth : bundle.views[kWrong].depth.pixels()) depth *= by;
        const DepthDisagreement found = measureDepthDisagreement(bundle);
        for (std::size_t v = 0; v < bundle.views.size(); ++v) {
            EXPECT_EQ(found.views[v].disagrees(), v == kWrong) << v;
            EXPECT_EQ(found.views[v].beyond, v == kWrong ? OverlapSettings().overlapTolerance : 0)
                << v;
        }
        const auto note = disagreementNote(bundle, found, false);
        ASSERT_TRUE(note);
        EXPECT_NE(note->find("1 of 5 views disagrees"), std::string::npos) << *note;
        EXPECT_NE(note->find("'view3' by more than 10 %"), std::string::npos) << *note;
        EXPECT_EQ(note->find("(0 %)"), std::string::npos) << *note;
    }
}

/// Views that are not kept give the same, in whichever order and on however many threads they come.
void expectTheSameOneByOne(const Bundle& bundle, const OverlapSettings& settings) {
    const DepthDisagreement whole = measureDepthDisagreement(bundle, settings);
    ASSERT_GT(whole.pairs, 0);
    DisagreementByView each(bundle.views.size(), settings);
    for (std::size_t v = bundle.views.size(); v-- > 0;) each.sample(v, bundle.views[v].depth);
    int last = 0;
    const auto count = static_cast<std::int64_t>(bundle.views.size());
    std::mutex mutex;
    parallelFor(0, count, [&](std::int64_t i) {
        const auto v = static_cast<std::size_t>(count - 1 - i);
        const bool now = each.compare(v, bundle.views[v].depth, bundle);
        const std::lock_guard lock(mutex);
        last += now;
    });
    EXPECT_EQ(last, 1);
    EXPECT_FALSE(each.compare(0, bundle.views[0].depth, bundle));
    const DepthDisagreement found = each.result();
    EXPECT_EQ(found.pairs, whole.pairs);
    EXPECT_EQ(found.overlap, whole.overlap);
    EXPECT_EQ(found.relative, whole.relative);
    ASSERT_EQ(found.views.size(), whole.views.size());
    for (std::size_t v = 0; v < found.views.size(); ++v) {
        const ViewDisagreement &a = found.views[v], &b = whole.views[v];
        EXPECT_EQ(std::tie(a.partners, a.overlap, a.relative, a.oneSurface, a.farthest,
                           a.farthestBy, a.beyond),
                  std::tie(b.partners, b.overlap, b.relative, b.oneSurface, b.farthest,
                           b.farthestBy, b.beyond))
            << v;
    }
    EXPECT_EQ(disagreementNote(bundle, found, false), disagreementNote(bundle, whole, false));
}

TEST(DepthDisagreement, OfViewsOneByOneIsThatOfAllAtOnce) {
    for (const AnalyticScene scene : {AnalyticScene::room, AnalyticScene::object}) {
        Bundle bundle = exactViews(scene);
        for (int i = 0; i < 7; ++i)
            bundle.views.push_back(bundle.views[static_cast<std::size_t>(i) % kViews]);
        for (std::size_t v = 0; v < bundle.views.size(); ++v)
            for (float& depth : bundle.views[v].depth.pixels())
                depth *= 1.0f + 0.003f * static_cast<float>(v * v % 5);
        bundle.views[6].background = bundle.views[9].background = true;
        OverlapSettings settings;
        settings.neighbours = 3;
        expectTheSameOneByOne(bundle, settings);
    }
}

TEST(DepthDisagreement, OfDepthThatIsFarOffOneByOneIsThatOfAllAtOnce) {
    Bundle bundle = exactViews(AnalyticScene::room);
    for (float& depth : bundle.views[kWrong].depth.pixels()) depth *= 1.5f;
    expectTheSameOneByOne(bundle, OverlapSettings());
}

TEST(DepthDisagreement, OfManyViewsEachIsLookedForInSome) {
    constexpr int kMany = 80;
    Bundle bundle;
    for (int i = 0; i < kMany; ++i)
        bundle.views.push_back(viewOfAnalyticScene(
            AnalyticScene::object, analyticCamera(AnalyticScene::object, i, kMany).resized(80, 60),
            1));
    const OverlapSettings settings;
    expectTheSameOneByOne(bundle, settings);
    const DepthDisagreement found = measureDepthDisagreement(bundle, settings);
    for (std::size_t v = 0; v < bundle.views.size(); ++v) {
        EXPECT_GE(found.views[v].partners, settings.neighbours) << v;
        EXPECT_FALSE(found.views[v].disagrees()) << v;
    }
}

// The other two have one good partner each.
TEST(DepthDisagreement, OfThreeViewsTheWrongOneIsNamed) {
    Bundle bundle = exactViews(AnalyticScene::room);
    bundle.views.resize(3);
    for (float& depth : bundle.views[1].depth.pixels()) depth *= 0.98f;
    const DepthDisagreement found = measureDepthDisagreement(bundle);
    for (std::size_t v = 0; v < bundle.views.size(); ++v)
        EXPECT_EQ(found.views[v].disagrees(), v == 1) << v;
}

TEST(DepthDisagreement, FindsACameraThatIsNotWhereItsPoseSays) {
    Bundle bundle = exactViews(AnalyticScene::object);
    Camera& camera = bundle.views[kWrong].camera;
    camera.position += 0.02 * glm::length(camera.position) * camera.forward();
    const DepthDisagreement found = measureDepthDisagreement(bundle);
    for (std::size_t v = 0; v < bundle.views.size(); ++v)
        EXPECT_EQ(found.views[v].disagrees(), v == kWrong) << v << ": " << found.views[v].relative;
}

// What a code rounds off and what is less than half a pixel does not count.
TEST(DepthDisagreement, LeavesWhatCodesAndPixelsRoundOff) {
    Bundle bundle = exactViews(AnalyticScene::room);
    for (ReferenceView& view : bundle.views) {
        view.depthBits = 8;
        view.farPlane *= 10;
        for (float& depth : view.depth.pixels())
            depth = static_cast<float>(view.depthCode().decode(view.depthCode().encode(depth)));
    }
    const DepthDisagreement coarse = measureDepthDisagreement(bundle);
    EXPECT_FALSE(coarse.disagrees());
    EXPECT_GT(coarse.views[0].relative, 0.003) << "the case is of no use";
    Bundle small;
    for (const ReferenceView& view : exactViews(AnalyticScene::room).views)
        small.views.push_back(
            viewOfAnalyticScene(AnalyticScene::room, view.camera.resized(50, 38), 1));
    for (float& depth : small.views[kWrong].depth.pixels()) depth *= 1.003f;
    EXPECT_FALSE(measureDepthDisagreement(small).disagrees());
}

// A plate of 3 % of the distance, seen from both sides.
TEST(DepthDisagreement, TheOtherSideIsNotTheSameSurface) {
    Bundle bundle;
    for (const double side : {1.0, -1.0}) {
        ReferenceView view;
        view.camera = Camera::fromFieldOfView({0, 0, side}, *lookAt({0, 0, side}, {0, 0, 0}),
                                              {0.8, 0.8}, false, 64, 64);
        view.depth = Image<float>(64, 64, 0.985f);
        view.texture = Rgba8Image(64, 64, glm::u8vec4(255));
        view.depthBits = 32;
        bundle.views.push_back(view);
    }
    EXPECT_EQ(measureDepthDisagreement(bundle).views[0].partners, 0);
    bundle.views.push_back(bundle.views[0]);
    EXPECT_EQ(measureDepthDisagreement(bundle).views[0].partners, 1);
}

TEST(DepthDisagreement, BackgroundsAreOfOtherTimes) {
    Bundle bundle = exactViews(AnalyticScene::room);
    bundle.views[kWrong].background = true;
    const DepthDisagreement found = measureDepthDisagreement(bundle);
    EXPECT_EQ(found.views[kWrong].partners, 0);
    EXPECT_EQ(found.views[kWrong].farthest, -1);
    EXPECT_EQ(found.views[0].partners, kViews - 2);
}

TEST(DepthDisagreement, IsTheSameOnAnyNumberOfThreads) {
    Bundle bundle = exactViews(AnalyticScene::room);
    for (float& depth : bundle.views[kWrong].depth.pixels()) depth *= 1.01f;
    const auto on = [&](int threads) {
        const ThreadLimit limit(threads);
        return measureDepthDisagreement(bundle);
    };
    const DepthDisagreement one = on(1), three = on(3);
    EXPECT_EQ(one.relative, three.relative);
    for (std::size_t v = 0; v < bundle.views.size(); ++v)
        EXPECT_EQ(one.views[v].relative, three.views[v].relative);
}

}  // namespace
}  // namespace stx
