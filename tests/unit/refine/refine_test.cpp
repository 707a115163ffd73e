// The steps of refining together: what they leave alone, what they report, and how they are chosen.

#include "lib/refine/refine.hpp"

#include <cmath>
#include <fstream>
#include <iterator>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "lib/packing/packing.hpp"
#include "lib/packing/prune.hpp"
#include "lib/render/bench/analytic_scene.hpp"
#include "lib/render/scene/page_set.hpp"
#include "lib/surface/normals.hpp"
#include "tests/noisy_depth.hpp"

namespace stx {
namespace {

constexpr int kRefinedViews = 3, kWidth = 160, kHeight = 120;

/// Small views of a closed room: every pixel is a point.
Bundle room() {
    Bundle bundle;
    for (int i = 0; i < kRefinedViews; ++i)
        bundle.views.push_back(viewOfAnalyticScene(
            AnalyticScene::room,
            analyticCamera(AnalyticScene::room, i, kRefinedViews).resized(kWidth, kHeight), 2));
    return bundle;
}

Bundle noisyRoom() {
    Bundle bundle = room();
    noisy::addNoise(bundle, 0.005);
    return bundle;
}

/// Root of the mean square of what the depth of a set is off by, a share of the distance.
double off(const PageSet& set, const Bundle& exact) {
    double sum = 0, count = 0;
    for (std::size_t v = 0; v < exact.views.size(); ++v) {
        const Image<float>& depth = *set.pages()[v].depth;
        for (std::size_t i = 0; i < depth.count(); ++i) {
            if (!hasPoint(depth.data()[i])) continue;
            const double d = depth.data()[i] / exact.views[v].depth.data()[i] - 1;
            sum += d * d;
            ++count;
        }
    }
    return std::sqrt(sum / count);
}

TEST(Refine, LeavesExactDepthAsItIs) {
    const Bundle bundle = room();
    RefineReport report;
    const PageSet refined = PageSet(bundle).refined(RefineSettings::all(), &report);
    EXPECT_FALSE(report.changed()) << report.text();
    EXPECT_TRUE(refined.exactDepth());
    for (std::size_t v = 0; v < bundle.views.size(); ++v)
        EXPECT_EQ(refined.pages()[v].depth, &bundle.views[v].depth);
}

TEST(Refine, SaysWhatItFoundAndDid) {
    const Bundle bundle = noisyRoom();
    RefineReport report;
    const PageSet refined = PageSet(bundle).refined({}, &report);
    EXPECT_NEAR(report.noise, 0.005, 0.0015);
    EXPECT_EQ(report.of(RefineStep::noise).views, kRefinedViews);
    EXPECT_GT(report.of(RefineStep::noise).pixels, kRefinedViews * kWidth * kHeight * 9 / 10);
    EXPECT_NEAR(report.of(RefineStep::noise).meanMove, 0.004, 0.002);
    EXPECT_GT(report.of(RefineStep::agree).pixels, 0);
    EXPECT_EQ(report.of(RefineStep::strays).pixels, 0) << "of splats only";
    EXPECT_FALSE(refined.exactDepth());
    EXPECT_GT(refined.views()[0].refined.doubt, 0.0f);
    EXPECT_LT(off(refined, room()), 0.6 * off(PageSet(bundle), room()));
}

// A sensor's own errors are smooth: nothing in one view tells of them.
TEST(Refine, CapturedViewsThatDisagreeMeetInTheMiddle) {
    const Bundle exact = room();
    for (const NoDepth missing : {NoDepth::unknown, NoDepth::empty}) {
        Bundle bundle = exact;
        for (std::size_t v = 0; v < bundle.views.size(); ++v) {
            bundle.views[v].noDepth = missing;
            const float off = 0.992f + 0.008f * static_cast<float>(v);
            for (float& depth : bundle.views[v].depth.pixels()) depth *= off;
        }
        RefineReport report;
        const PageSet before(bundle), refined = before.refined({}, &report);
        if (missing == NoDepth::empty) {
            EXPECT_FALSE(report.changed()) << "a program knows: " << report.text();
            continue;
        }
        EXPECT_EQ(report.of(RefineStep::agree).views, kRefinedViews);
        EXPECT_LT(off(refined, exact), 0.8 * off(before, exact));
        // Views in the rectangles of an atlas are looked at one by one first.
        Job job;
        const auto packed = pack(bundle, {}, job);
        ASSERT_TRUE(packed) << packed.error().text();
        const auto pages = PageSet::of(*packed, job);
        ASSERT_TRUE(pages);
        (void)pages->refined({}, &report);
        EXPECT_EQ(report.of(RefineStep::agree).views, kRefinedViews);
    }
}

TEST(Refine, DoesTheStepsThatAreAskedFor) {
    const Bundle bundle = noisyRoom();
    RefineReport report;
    const auto only = RefineSettings::from("noise");
    ASSERT_TRUE(only);
    const PageSet some = PageSet(bundle).refined(*only, &report);
    EXPECT_EQ(report.names(), "noise");
    EXPECT_LT(off(PageSet(bundle).refined({}), room()), off(some, room()));
    const PageSet none = PageSet(bundle).refined(RefineSettings::none(), &report);
    EXPECT_FALSE(report.changed());
    EXPECT_EQ(none.pages()[0].depth, &bundle.views[0].depth);
}

TEST(Refine, ABundleIsRefinedOnce) {
    Bundle bundle = noisyRoom();
    const PageSet refined = PageSet(bundle).refined({});
    Bundle better = bundle;
    Job job;
    const auto report = refine(better, {}, job);
    ASSERT_TRUE(report) << report.error().text();
    EXPECT_TRUE(report->changed());
    for (std::size_t v = 0; v < bundle.views.size(); ++v) {
        EXPECT_EQ(better.views[v].depth, *refined.pages()[v].depth) << v;
        EXPECT_EQ(better.views[v].refined, refined.views()[v].refined) << v;
        EXPECT_EQ(better.views[v].refined.steps, report->names());
        EXPECT_EQ(better.views[v].noDepth, NoDepth::unknown);
    }
    EXPECT_TRUE(better.check());
    const Bundle once = better;
    const auto again = refine(better, RefineSettings().forSplats(), job);
    ASSERT_TRUE(again);
    EXPECT_EQ(again->names(), "strays");
    EXPECT_EQ(again->of(RefineStep::noise).pixels, 0);
    const auto third = refine(better, RefineSettings::all(), job);
    ASSERT_TRUE(third);
    EXPECT_FALSE(third->changed()) << third->text();
}

// They were those of the noise: drawn in light 18.9 dB, with none at all 31.9.
TEST(Refine, NormalsAndSplatAxesFollowTheDepth) {
    Job job;
    Bundle baked = noisyRoom(), expected = noisyRoom();
    ASSERT_TRUE(bake(baked, {}, job));
    const Bundle given = baked;
    ASSERT_TRUE(refine(baked, {}, job));
    ASSERT_TRUE(refine(expected, {}, job));
    ASSERT_TRUE(bake(expected, {}, job));
    const PageSet pages = PageSet(given).refined({});
    const auto atlas = pack(given, {}, job);
    ASSERT_TRUE(atlas) << atlas.error().text();
    const auto packed = PageSet::of(*atlas, job);
    ASSERT_TRUE(packed);
    const PageSet ofAtlas = packed->refined({});
    std::size_t same = 0, count = 0;
    for (std::size_t v = 0; v < given.views.size(); ++v) {
        const ReferenceView &is = baked.views[v], &was = given.views[v];
        for (const Image<glm::vec3> ReferenceView::*kind :
             {&ReferenceView::normal, &ReferenceView::splatU, &ReferenceView::splatV})
            for (std::size_t i = 0; i < was.depth.count(); ++i) {
                const bool stays = was.depth.data()[i] == is.depth.data()[i];
                ASSERT_EQ((is.*kind).data()[i],
                          ((stays ? was : expected.views[v]).*kind).data()[i]);
                same += stays;
                ++count;
            }
        EXPECT_EQ(*pages.pages()[v].normal, is.normal);
        EXPECT_EQ(*pages.pages()[v].splatU, is.splatU);
        EXPECT_EQ(*pages.pages()[v].splatV, is.splatV);
        const ReferenceView copy = ofAtlas.copyOfView(v);
        EXPECT_EQ(copy.depth, is.depth);
        EXPECT_EQ(copy.normal, is.normal);
        EXPECT_EQ(copy.splatV, is.splatV);
    }
    EXPECT_LT(same, count / 10);
}

TEST(Refine, BackgroundsAreOfOtherTimes) {
    Bundle bundle = noisyRoom();
    Bundle alone = bundle;
    alone.views.pop_back();
    bundle.views.back().background = true;
    Job job;
    ASSERT_TRUE(refine(bundle, {}, job));
    ASSERT_TRUE(refine(alone, {}, job));
    for (std::size_t v = 0; v < alone.views.size(); ++v)
        EXPECT_EQ(bundle.views[v].depth, alone.views[v].depth) << v;
}

TEST(Refine, WhatViewsHaveHadIsAText) {
    const Refined refined{"noise,agree", 0.0031f};
    EXPECT_EQ(refined.text(), "noise,agree 0.0031");
    EXPECT_EQ(Refined::from(refined.text()), refined);
    EXPECT_EQ(Refined::from("edges 0"), (Refined{"edges", 0}));
    Refined moved{"poses", 0};
    moved.moved = CameraMove{{0.1, -2e-7, 3}, glm::normalize(glm::dquat(1, 0.01, -0.002, 1.0 / 3))};
    EXPECT_EQ(Refined::from(moved.text()), moved);
    for (const char* wrong :
         {"poses 0 1 2 3 1 0 0", "poses 0 1 2 3 1 0 0 0 0", "poses 0 1 2 3 2 0 0 0",
          "poses 0 1 2 nan 1 0 0 0", "poses 0 1 2  3 1 0 0 0", "poses 0 1 2 3 1 0 0 0 "})
        EXPECT_FALSE(Refined::from(wrong)) << wrong;
    for (const char* wrong : {"", "noise", "noise ", " 0.1", "noise -1", "noise 2", "noise nan",
                              "noise 0.1 more", "Noise 0.1", "a;b 0"})
        EXPECT_FALSE(Refined::from(wrong)) << wrong;
}

TEST(Refine, StepsAreTheTableOfTheirPage) {
    std::ifstream file(STX_SOURCE_DIR "/lib/refine/README.md");
    const std::string page((std::istreambuf_iterator<char>(file)), {});
    std::string table;
    for (const RefineStepInfo& s : refineSteps()) {
        EXPECT_EQ(&infoOf(s.step), &s);
        const char* when = s.when == RefineWhen::import   ? "import"
                           : s.when == RefineWhen::refine ? "refine"
                                                          : "both";
        table += fmt::format("| `{}` | {} | {} | {}{} |\n", s.name, when, s.usual, s.sentence,
                             s.source.empty() ? "" : fmt::format(" ({})", s.source));
    }
    EXPECT_NE(page.find(table), std::string::npos) << table;
}

TEST(Refine, StepsOfImportsAreAskedForThere) {
    const auto some = RefineSettings::from("gaps,steps");
    ASSERT_TRUE(some);
    EXPECT_TRUE(some->atImport(RefineStep::steps, false));
    EXPECT_FALSE(some->atImport(RefineStep::mixed, true));
    EXPECT_TRUE(some->atImport(RefineStep::reproject, true)) << "depth would lie on wrong pixels";
    EXPECT_FALSE(some->on(RefineStep::steps)) << "of stored depth only";
    EXPECT_TRUE(some->on(RefineStep::gaps));
    EXPECT_FALSE(some->afterImport().any());
    const auto changed = RefineSettings::from("auto,gaps,-noise,-reproject");
    ASSERT_TRUE(changed);
    EXPECT_TRUE(changed->on(RefineStep::gaps) && changed->on(RefineStep::agree));
    EXPECT_FALSE(changed->on(RefineStep::noise) || changed->on(RefineStep::mixed));
    EXPECT_TRUE(changed->atImport(RefineStep::mixed, true));
    EXPECT_FALSE(changed->atImport(RefineStep::reproject, true));
    EXPECT_TRUE(changed->asked().on(RefineStep::gaps));
    EXPECT_FALSE(changed->asked().on(RefineStep::agree));
}

TEST(Refine, StepsThatAreAskedForDoNotStandForTheOthers) {
    RefineSettings settings;
    settings.set(RefineStep::mixed, true);
    settings.set(RefineStep::poses, true);
    const RefineSettings left = settings.after({"mixed", 0});
    EXPECT_FALSE(left.on(RefineStep::mixed));
    EXPECT_TRUE(left.on(RefineStep::poses) && left.on(RefineStep::noise));
    const RefineSettings measured = settings.after({"noise", 0.001f});
    EXPECT_TRUE(measured.on(RefineStep::mixed) && measured.on(RefineStep::poses));
    EXPECT_FALSE(measured.on(RefineStep::noise) || measured.on(RefineStep::exposure));
}

TEST(Refine, MatchedColoursAreKeptAndNotMatchedAgain) {
    Bundle bundle;
    for (int i = 0; i < 6; ++i)
        bundle.views.push_back(
            viewOfAnalyticScene(AnalyticScene::object,
                                analyticCamera(AnalyticScene::object, i, 6).resized(256, 256), 2));
    noisy::changeLight(bundle);
    RefineStepReport ofPages;
    const PageSet pages = PageSet(bundle).inOneLight({}, ofPages);
    Bundle better = bundle;
    Job job;
    const auto report = refine(better, {}, job);
    ASSERT_TRUE(report) << report.error().text();
    EXPECT_EQ(report->of(RefineStep::exposure).views, ofPages.views);
    EXPECT_GT(report->of(RefineStep::exposure).pixels, 0);
    EXPECT_GT(report->of(RefineStep::exposure).meanMove, 0.01);
    for (std::size_t v = 0; v < bundle.views.size(); ++v) {
        EXPECT_EQ(*better.views[v].texture.rgba8(), *pages.pages()[v].texture->rgba8()) << v;
        EXPECT_EQ(better.views[v].refined.steps, "exposure");
    }
    // Whatever is seen in it later.
    noisy::changeLight(better);
    RefineStepReport again;
    (void)PageSet(better).inOneLight({}, again);
    EXPECT_EQ(again.views, 0);
    EXPECT_FALSE(refine(better, {}, job)->changed());
    RefineSettings without;
    without.set(RefineStep::exposure, false);
    const auto left = refine(bundle, without, job);
    ASSERT_TRUE(left);
    EXPECT_FALSE(left->changed()) << left->text();
}

TEST(Refine, PointsThatWereDroppedAreNotSeenThrough) {
    Bundle bundle = room();
    bundle.views.resize(1);
    ReferenceView& view = bundle.views[0];
    ASSERT_EQ(view.noDepth, NoDepth::empty);
    // Hangs far before the walls, alone.
    view.depth.at(40, 40) *= 0.5f;
    const float beside = view.depth.at(41, 40);
    Job job;
    const auto only = RefineSettings::from("mixed");
    ASSERT_TRUE(only);
    const auto report = refine(bundle, *only, job);
    ASSERT_TRUE(report) << report.error().text();
    EXPECT_EQ(report->names(), "mixed");
    EXPECT_GE(report->of(RefineStep::mixed).pixels, 1);
    EXPECT_FALSE(hasPoint(view.depth.at(40, 40)));
    EXPECT_EQ(view.depth.at(41, 40), beside);
    EXPECT_EQ(view.noDepth, NoDepth::unknown);
    EXPECT_EQ(view.refined.steps, "mixed");
}

TEST(Refine, WhatWasPrunedIsNotMissing) {
    Bundle pruned = room();
    Job job;
    const auto pruning = prune(pruned, {}, job);
    ASSERT_TRUE(pruning) << pruning.error().text();
    ASSERT_LT(pruning->keptPixels, pruning->sourcePixels);
    // Alone amid what was pruned: it is not a speck of dust.
    ReferenceView& view = pruned.views[0];
    for (int y = 38; y <= 42; ++y)
        for (int x = 38; x <= 42; ++x)
            if (x != 40 || y != 40) view.depth.at(x, y) = kNoDepth;
    view.depth.at(40, 40) = room().views[0].depth.at(40, 40);
    view.pruned = true;
    for (const char* step : {"gaps", "mixed"}) {
        Bundle refined = pruned, whole = room();
        const auto only = RefineSettings::from(step);
        ASSERT_TRUE(only);
        ASSERT_TRUE(refine(refined, *only, job));
        ASSERT_TRUE(refine(whole, *only, job));
        // Only what changes in whole views does: some pixels of a room hang between its walls.
        const Bundle exact = room();
        for (std::size_t v = 0; v < exact.views.size(); ++v)
            for (std::size_t i = 0; i < exact.views[v].depth.count(); ++i)
                if (whole.views[v].depth.data()[i] == exact.views[v].depth.data()[i]) {
                    ASSERT_EQ(refined.views[v].depth.data()[i], pruned.views[v].depth.data()[i])
                        << step << ", view " << v << ", pixel " << i;
                }
    }
}

TEST(Refine, SettingsAreNamesOfSteps) {
    const auto two = RefineSettings::from("agree,edges");
    ASSERT_TRUE(two);
    for (const RefineStepInfo& step : refineSteps())
        EXPECT_EQ(two->on(step.step), step.name == "agree" || step.name == "edges") << step.name;
    EXPECT_FALSE(two->forSplats().on(RefineStep::strays));
    EXPECT_FALSE(RefineSettings::from("auto")->on(RefineStep::strays));
    EXPECT_TRUE(RefineSettings::from("auto")->forSplats().on(RefineStep::strays));
    EXPECT_FALSE(RefineSettings::from("off")->forSplats().any());
    for (const char* wrong :
         {"", "all", "noise,", "noise,,agree", "Noise", "auto,", "auto,-", "-noise", "off,noise"}) {
        const auto made = RefineSettings::from(wrong);
        ASSERT_FALSE(made) << wrong;
        EXPECT_EQ(made.error().code, ErrorCode::usage);
        EXPECT_NE(made.error().text().find("silhouettes"), std::string::npos);
    }
}

TEST(Refine, StraysAreUnknown) {
    Bundle bundle = noisyRoom();
    Image<float>& depth = bundle.views[0].depth;
    depth.at(40, 30) *= 0.8f;
    const PageSet refined = PageSet(bundle).refined(RefineSettings::all());
    EXPECT_FALSE(hasPoint(refined.pages()[0].depth->at(40, 30)));
    EXPECT_TRUE(refined.views()[0].depthMayBeUnknown());
}

}  // namespace
}  // namespace stx
