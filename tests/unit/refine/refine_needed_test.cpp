// Whether views need refining is found while they are looked at one by one, as refine() finds it
// when all are there.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>

#include "lib/base/parallel.hpp"
#include "lib/refine/refine_needed.hpp"
#include "lib/render/bench/analytic_scene.hpp"
#include "tests/noisy_depth.hpp"
#include "tests/torus_bundle.hpp"

namespace stx {
namespace {

std::vector<ViewImageKinds> allKinds(const Bundle& bundle) {
    std::vector<ViewImageKinds> kinds;
    for (const ReferenceView& view : bundle.views) kinds.push_back(ViewImageKinds::of(view));
    return kinds;
}

/// Gives copies: nothing is held.
class CopiedViews : public ViewTable {
  public:
    CopiedViews(const Bundle& bundle, Bundle headers)
        : ViewTable(std::move(headers), allKinds(bundle)), bundle_(bundle) {}

  protected:
    Result<std::shared_ptr<const ReferenceView>> make(std::size_t index, Job&) const override {
        ++asked;
        return std::make_shared<ReferenceView>(bundle_.views[index]);
    }

  public:
    mutable std::atomic<int> asked = 0;

  private:
    const Bundle& bundle_;
};

/// The same, by who has looked at them before.
class ViewsSeen : public CopiedViews, public ViewsLookedAt {
  public:
    ViewsSeen(const Bundle& bundle, Bundle headers) : CopiedViews(bundle, std::move(headers)) {
        for (const ReferenceView& view : bundle.views) points_.push_back(colourPointsOf(view));
    }
    const ColourPoints* colourPoints() const override { return &points_; }

  private:
    ColourPoints points_;
};

/// `asked`: of each view, at most.
void expectNeeds(const Bundle& bundle, const RefineSettings& settings, bool needed, int asked) {
    Bundle headers;
    for (const ReferenceView& view : bundle.views)
        static_cast<ViewHeader&>(headers.views.emplace_back()) = view;
    const CopiedViews table(bundle, headers);
    Job job;
    const auto may = mayRefine(table, settings, job);
    ASSERT_TRUE(may) << may.error().text();
    EXPECT_EQ(*may, needed);
    EXPECT_LE(table.asked, asked * static_cast<int>(bundle.views.size()));
    const ViewsSeen seen(bundle, headers);
    const auto found = mayRefine(seen, settings, job);
    ASSERT_TRUE(found) << found.error().text();
    EXPECT_EQ(*found, needed);
    // Where views are looked at twice, one look is spared; colours behind are not looked at.
    const auto views = static_cast<int>(bundle.views.size());
    const auto inFront = std::ranges::count(bundle.views, false, &ReferenceView::background);
    EXPECT_LE(seen.asked, table.asked > views ? table.asked - inFront : views);
    Bundle refined = bundle;
    const auto report = refine(refined, settings, job);
    ASSERT_TRUE(report);
    EXPECT_EQ(report->changed(), needed);
}

TEST(RefineNeeded, NotOfExactViews) {
    const Bundle torus = torusViews(96);
    expectNeeds(torus, {}, false, 2);
    expectNeeds(torus, RefineSettings().forSplats(), false, 2);
    RefineSettings without;
    without.set(RefineStep::exposure, false);
    expectNeeds(torus, without, false, 1);
    expectNeeds(torus, RefineSettings::none(), false, 0);
    for (const AnalyticScene scene : {AnalyticScene::object, AnalyticScene::room})
        expectNeeds(analyticBundle(scene, 6), {}, false, 4);
}

TEST(RefineNeeded, ReadsWhatIsBehindByItself) {
    Bundle torus = torusViews(96);
    torus.views[3].background = torus.views[7].background = true;
    expectNeeds(torus, {}, false, 2);
    RefineSettings without;
    without.set(RefineStep::exposure, false);
    expectNeeds(torus, without, false, 1);
}

TEST(RefineNeeded, OfNoise) {
    Bundle noisy = torusViews(96);
    noisy::addNoise(noisy, 0.01);
    expectNeeds(noisy, {}, true, 1);
    // Once is enough.
    for (ReferenceView& view : noisy.views) view.refined.steps = "noise";
    expectNeeds(noisy, {}, false, 0);
}

TEST(RefineNeeded, NoisyViewsAreNotReadToTheEnd) {
    Bundle noisy = torusViews(96);
    noisy::addNoise(noisy, 0.01);
    ASSERT_GT(noisy.views.size(), 4u);
    Bundle headers;
    for (const ReferenceView& view : noisy.views)
        static_cast<ViewHeader&>(headers.views.emplace_back()) = view;
    const CopiedViews table(noisy, headers);
    const ThreadLimit threads(2);
    Job job;
    const auto may = mayRefine(table, {}, job);
    ASSERT_TRUE(may);
    EXPECT_TRUE(*may);
    EXPECT_LE(table.asked, 2) << "the first tell";
}

TEST(RefineNeeded, OfNoiseThatNoSmallViewHasEnoughOf) {
    // Each of less than 500 points, together of more: see kFewestNoisy.
    Bundle noisy = torusViews(24);
    noisy::addNoise(noisy, 0.01);
    for (const ReferenceView& view : noisy.views) ASSERT_LT(view.pointCount(), 500);
    expectNeeds(noisy, {}, true, 1);
}

TEST(RefineNeeded, OfACameraThatExposesForItself) {
    Bundle bundle = analyticBundle(AnalyticScene::object, 6);
    for (auto& c : bundle.views[2].texture.rgba8()->pixels()) {
        const glm::vec3 dark = 0.9f * glm::vec3(c) + 5.0f;
        if (c.a > 0) c = glm::u8vec4(glm::u8vec3(dark + 0.5f), c.a);
    }
    expectNeeds(bundle, {}, true, 4);
    RefineSettings without;
    without.set(RefineStep::exposure, false);
    expectNeeds(bundle, without, false, 1);
}

TEST(RefineNeeded, OfCapturedViewsWithoutALook) {
    Bundle bundle = torusViews(48);
    for (ReferenceView& view : bundle.views) view.noDepth = NoDepth::unknown;
    Bundle headers;
    for (const ReferenceView& view : bundle.views)
        static_cast<ViewHeader&>(headers.views.emplace_back()) = view;
    const CopiedViews table(bundle, headers);
    Job job;
    const auto may = mayRefine(table, {}, job);
    ASSERT_TRUE(may);
    EXPECT_TRUE(*may);
    EXPECT_EQ(table.asked, 0);
}

}  // namespace
}  // namespace stx
