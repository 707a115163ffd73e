#include "lib/quality/prune_quality.hpp"

#include <gtest/gtest.h>

#include "lib/base/parallel.hpp"
#include "lib/capture/capture.hpp"
#include "lib/geometry/view_layout.hpp"
#include "lib/metrics/compare.hpp"
#include "lib/packing/packing.hpp"
#include "lib/packing/views_one_by_one.hpp"
#include "tests/shared_data.hpp"
#include "tests/spheres_miv.hpp"
#include "tests/torus_bundle.hpp"
#include "tests/unit/packing/holes.hpp"
#include "tests/unit/surface/analytic.hpp"

namespace stx {
namespace {

TEST(Prune, LeavesNoHoleAndHardlyADifference) {
    const Bundle before = torusViews();
    Bundle after = before;
    Job job;
    const auto report = prune(after, {}, job);
    ASSERT_TRUE(report) << report.error().text();
    EXPECT_EQ(report->sourcePixels, before.pointCount());
    EXPECT_EQ(report->keptPixels, after.pointCount());
    EXPECT_LT(report->keptPixels, before.pointCount() * 6 / 10);
    EXPECT_GT(report->psnr, 40);
    PackSettings settings;
    settings.layout = PackSettings::Layout::tight;
    settings.sourcePixels = report->sourcePixels;
    const auto atlas = pack(after, settings, job);
    ASSERT_TRUE(atlas);
    EXPECT_EQ(atlas->sourcePixels, report->sourcePixels);
    EXPECT_EQ(atlas->keptPixels, after.pointCount());
    const auto unpacked = unpack(*atlas, job);
    ASSERT_TRUE(unpacked);
    for (const glm::dvec3 eye :
         {glm::dvec3(1, 2, 2), glm::dvec3(-2, 1, 2), glm::dvec3(0.5, -2.6, 1)}) {
        const Camera camera = analytic::lookingAt(eye, 192);
        const Frame a = draw(before, camera);
        for (const Bundle& b : {std::cref(after), std::cref(*unpacked)}) {
            const Frame c = draw(b, camera);
            EXPECT_EQ(holes(a, c), 0);
            const auto difference = compare(a.colour, c.colour);
            ASSERT_TRUE(difference);
            EXPECT_GT(difference->psnrRgb.value_or(99), 32);
        }
    }
}

TEST(Prune, WhatOneViewMissesStaysClosedInOthers) {
    // A sensor that misses a square in each view, elsewhere each time: background, by its alpha.
    // Those that show the place outvote it before pruning.
    Bundle before = torusViews(128, glm::dvec3(0.0), {ViewLayout::Kind::sphere, 40, 0});
    for (std::size_t i = 0; i < before.views.size(); ++i) {
        ReferenceView& view = before.views[i];
        const int x0 = 40 + static_cast<int>(i * 29 % 37), y0 = 45 + static_cast<int>(i * 17 % 31);
        for (int y = y0; y < y0 + 12; ++y) {
            for (int x = x0; x < x0 + 12; ++x) {
                view.depth.at(x, y) = kNoDepth;
                view.texture.rgba8()->at(x, y).a = 0;
            }
        }
    }
    Bundle after = before;
    Job job;
    const auto report = prune(after, {}, job);
    ASSERT_TRUE(report) << report.error().text();
    EXPECT_LT(report->keptPixels, report->sourcePixels / 2);
    for (const glm::dvec3 eye :
         {glm::dvec3(1, 2, 2), glm::dvec3(-2, 1, 2), glm::dvec3(0.5, -2.6, 1)}) {
        const Camera camera = analytic::lookingAt(eye, 192);
        EXPECT_EQ(holes(draw(before, camera), draw(after, camera)), 0);
    }
}

TEST(Prune, ASheetSeenFromBothSidesIsTwoSurfaces) {
    // A sheet without thickness, half a view apart to each side: neither view shows the other's.
    Mesh mesh;
    mesh.materials.emplace_back();
    mesh.positions = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    mesh.triangleMaterial = {0, 0};
    Job job;
    auto bundle = captureBundle(
        mesh, {analytic::lookingAt({0, 0, 3}, 96), analytic::lookingAt({0.1, 0, -3}, 96)}, {}, job);
    ASSERT_TRUE(bundle);
    const auto count = bundle->pointCount();
    const auto report = prune(*bundle, {}, job);
    ASSERT_TRUE(report);
    EXPECT_EQ(report->keptPixels, count);
    EXPECT_FALSE(bundle->pruned());
}

TEST(Prune, TakenPixelsClaimNoEmptySpace) {
    const Bundle before = torusViews();
    Bundle after = before;
    Job job;
    ASSERT_TRUE(prune(after, {}, job));
    for (std::size_t i = 0; i < after.views.size(); ++i) {
        const auto &a = before.views[i], &b = after.views[i];
        EXPECT_TRUE(b.check());
        for (std::size_t k = 0; k < a.depth.count(); ++k) {
            const auto colour = b.texture.rgba8()->pixels()[k];
            if (hasPoint(b.depth.pixels()[k])) {
                EXPECT_EQ(a.depth.pixels()[k], b.depth.pixels()[k]);
                EXPECT_EQ(a.texture.rgba8()->pixels()[k], colour);
            } else {
                EXPECT_TRUE(colour.a == 255 || !hasPoint(a.depth.pixels()[k]));
            }
        }
    }
}

TEST(Prune, MaskedViewsOfUnknownDepthStayEmptyAround) {
    // Photographs with depth that were cut out: unknown depth is possible, but no pixel has it.
    Bundle bundle = torusViews();
    for (ReferenceView& view : bundle.views) view.noDepth = NoDepth::unknown;
    Job job;
    PackSettings settings;
    settings.layout = PackSettings::Layout::tight;
    settings.sourcePixels = bundle.pointCount();
    ASSERT_TRUE(prune(bundle, {}, job));
    ASSERT_TRUE(bundle.pruned());
    const auto atlas = pack(bundle, settings, job);
    ASSERT_TRUE(atlas);
    const auto unpacked = unpack(*atlas, job);
    ASSERT_TRUE(unpacked);
    for (const ReferenceView& view : unpacked->views) EXPECT_EQ(view.texture.at(0, 0).a, 0);

    // A photograph that fills its frame keeps the mark: nothing is known where its sensor failed.
    Bundle filled = torusViews();
    ReferenceView& photo = filled.views[0];
    photo.noDepth = NoDepth::unknown;
    for (glm::u8vec4& c : photo.texture.rgba8()->pixels()) c.a = 255;
    ASSERT_TRUE(prune(filled, {}, job));
    EXPECT_EQ(photo.noDepth, NoDepth::unknown);
    const auto filledAtlas = pack(filled, settings, job);
    ASSERT_TRUE(filledAtlas);
    const auto filledAgain = unpack(*filledAtlas, job);
    ASSERT_TRUE(filledAgain);
    EXPECT_EQ(filledAgain->views[0].texture.at(0, 0).a, 1);
}

TEST(Prune, AHoleOfTheSensorDoesNotFillWhatIsAroundAMask) {
    Bundle bundle = torusViews();
    Job job;
    PackSettings settings;
    settings.layout = PackSettings::Layout::tight;
    for (ReferenceView& view : bundle.views) {
        view.noDepth = NoDepth::unknown;
        const auto points = view.depth.pixels();
        const auto first = std::find_if(points.begin(), points.end(), hasPoint);
        *(first + 1) = kNoDepth;  // with full alpha
    }
    settings.sourcePixels = bundle.pointCount() + static_cast<int>(bundle.views.size());
    for (const bool pruned : {false, true}) {
        if (pruned) {
            ASSERT_TRUE(prune(bundle, {}, job));
        }
        const auto atlas = pack(bundle, settings, job);
        ASSERT_TRUE(atlas);
        const auto unpacked = unpack(*atlas, job);
        ASSERT_TRUE(unpacked);
        for (const ReferenceView& view : unpacked->views) EXPECT_EQ(view.texture.at(0, 0).a, 0);
    }
}

TEST(Prune, ManyHolesOfTheSensorDoNotFillWhatIsAroundAMask) {
    // Rectangles and their padding show more holes inside the mask than pixels around it.
    Bundle bundle = torusViews();
    for (ReferenceView& view : bundle.views) {
        view.noDepth = NoDepth::unknown;
        for (int y = 0; y < view.depth.height(); ++y)
            for (int x = 0; x < view.depth.width(); ++x)
                if (hasPoint(view.depth.at(x, y)) && (x / 6 + y / 6) % 2 == 0)
                    view.depth.at(x, y) = kNoDepth;  // with full alpha
        ASSERT_TRUE(lacksDepthByMask(view));
    }
    Job job;
    PackSettings settings;
    settings.layout = PackSettings::Layout::tight;
    for (const bool pruned : {false, true}) {
        if (pruned) {
            const auto report = prune(bundle, {}, job);
            ASSERT_TRUE(report) << report.error().text();
            settings.sourcePixels = report->sourcePixels;
        }
        const auto atlas = pack(bundle, settings, job);
        ASSERT_TRUE(atlas);
        for (const ReferenceView& view : atlas->views)
            EXPECT_TRUE(view.noDepth == NoDepth::empty || view.masked.value_or(false));
        const auto unpacked = unpack(*atlas, job);
        ASSERT_TRUE(unpacked);
        for (const ReferenceView& view : unpacked->views) {
            EXPECT_EQ(view.texture.at(0, 0).a, 0);
            EXPECT_FALSE(view.masked.has_value()) << "that is of atlases";
        }
    }
}

TEST(Prune, WhatASensorMissedIsCountedBeside) {
    // Two photographs that fill their frames; the sensor missed a part of the first.
    Bundle bundle = torusViews();
    bundle.views.resize(2);
    for (ReferenceView& view : bundle.views) {
        view.noDepth = NoDepth::unknown;
        for (glm::u8vec4& c : view.texture.rgba8()->pixels()) c.a = 255;
    }
    const auto pixels = static_cast<std::int64_t>(2 * bundle.views[0].depth.count());
    const auto points = bundle.pointCount();
    Job job;
    const std::vector<std::string> said = {
        fmt::format("of {} pixels that have colours but no depth, the tight layout keeps only "
                    "those amid others; --layout grid keeps all",
                    pixels - points)};
    // The same without pruning; a grid keeps all, and so does a mask that is empty around.
    for (const auto layout : {PackSettings::Layout::grid, PackSettings::Layout::tight}) {
        PackSettings settings;
        settings.layout = layout;
        ASSERT_TRUE(pack(bundle, settings, job));
        EXPECT_EQ(job.takeNotes(),
                  layout == PackSettings::Layout::tight ? said : std::vector<std::string>());
        Bundle masked = torusViews();
        for (ReferenceView& view : masked.views) view.noDepth = NoDepth::unknown;
        ASSERT_TRUE(pack(masked, settings, job));
        EXPECT_TRUE(job.takeNotes().empty());
    }
    for (const bool measured : {false, true}) {
        Bundle pruned = bundle;
        const auto report =
            measured ? pruneToQuality(pruned, {}, 120, job) : prune(pruned, {}, job);
        ASSERT_TRUE(report) << report.error().text();
        EXPECT_EQ(report->sourcePixels, pixels);
        EXPECT_EQ(report->sourcePoints, points);
        EXPECT_EQ(report->keptPixels, pruned.pointCount());
        EXPECT_EQ(report->unmeasuredPixels, pixels - points);
        PackSettings settings;
        settings.layout = PackSettings::Layout::tight;
        settings.sourcePixels = report->sourcePixels;
        settings.unmeasuredPixels = report->unmeasuredPixels;
        Job packing;
        const auto atlas = pack(pruned, settings, packing);
        ASSERT_TRUE(atlas);
        EXPECT_EQ(packing.takeNotes(), said);
        const auto unpacked = unpack(*atlas, job);
        ASSERT_TRUE(unpacked);
        EXPECT_EQ(unpacked->views[0].texture.at(0, 0).a, 1) << "unknown, not empty";
    }
}

TEST(Prune, BudgetsAndQualitiesAreKept) {
    const Bundle before = torusViews();
    Job job;
    PruneSettings settings;
    settings.budget = before.pointCount() * 7 / 10;
    Bundle some = before;
    const auto a = prune(some, settings, job);
    ASSERT_TRUE(a);
    EXPECT_LE(a->keptPixels, settings.budget);
    EXPECT_GT(a->keptPixels, settings.budget * 9 / 10) << "a budget is there to be used";
    settings.budget = 0;
    settings.minPsnr = a->psnr + 3;
    Bundle better = before;
    const auto b = prune(better, settings, job);
    ASSERT_TRUE(b);
    EXPECT_GE(b->psnr, settings.minPsnr);

    settings.minPsnr = 0;
    settings.budget = 50;
    Bundle tiny = before;
    (void)job.takeNotes();
    const auto c = prune(tiny, settings, job);
    ASSERT_FALSE(c);
    EXPECT_EQ(c.error().code, ErrorCode::invalidInput);
    EXPECT_NE(c.error().message.find("a budget of 50 pixels is too small"), std::string::npos);
    EXPECT_EQ(tiny.pointCount(), before.pointCount()) << "nothing is touched on an error";
    EXPECT_TRUE(job.takeNotes().empty()) << "no note says that the budget is met";
}

TEST(Prune, AQualityThatNothingReachesKeepsAll) {
    Bundle bundle = torusViews();
    bundle.views.resize(5);
    const auto count = bundle.pointCount();
    Job job;
    const auto report = pruneToQuality(bundle, {}, 120, job);
    ASSERT_TRUE(report) << report.error().text();
    EXPECT_EQ(report->keptPixels, count);
    EXPECT_EQ(bundle.pointCount(), count);
    EXPECT_EQ(job.takeNotes(),
              std::vector<std::string>{"nothing is pruned: 120 dB are reached by all pixels only"});
    PruneSettings settings;
    settings.budget = count * 9 / 10;
    const auto both = pruneToQuality(bundle, settings, 120, job);
    ASSERT_FALSE(both);
    EXPECT_NE(both.error().message.find("cannot both be had"), std::string::npos);
    EXPECT_EQ(bundle.pointCount(), count);
    EXPECT_FALSE(pruneToQuality(bundle, {}, -3, job));
}

TEST(Prune, OneViewAndViewsThatShareNothingStayWhole) {
    Bundle bundle = torusViews();
    bundle.views.resize(3);
    for (int i = 0; i < 3; ++i) bundle.views[i].camera.position.x += 50.0 * i;
    const auto count = bundle.pointCount();
    Job job;
    const auto report = prune(bundle, {}, job);
    ASSERT_TRUE(report);
    EXPECT_EQ(report->keptPixels, count);
    bundle.views.resize(1);
    const Bundle one = bundle;
    EXPECT_TRUE(prune(bundle, {}, job));
    EXPECT_EQ(bundle.views[0].depth, one.views[0].depth);
    EXPECT_EQ(bundle.views[0].texture, one.views[0].texture);
}

TEST(Prune, OnePixelObjectsAndEmptyViews) {
    Bundle bundle = torusViews();
    bundle.views.resize(2);
    for (auto& v : bundle.views) v.depth = Image<float>(192, 192, kNoDepth);
    bundle.views[0].depth.at(40, 40) = 3.0f;
    Job job;
    const auto report = prune(bundle, {}, job);
    ASSERT_TRUE(report);
    EXPECT_EQ(report->keptPixels, 1);
    EXPECT_EQ(report->emptiedViews, 1);
}

TEST(Prune, AThousandTinyViews) {
    Bundle bundle;
    for (int i = 0; i < 1000; ++i) {
        const double a = 0.00628 * i;
        bundle.views.push_back(analytic::capture(
            analytic::sphere, analytic::lookingAt({3 * std::sin(a), 0.5, 3 * std::cos(a)}, 16),
            16));
    }
    Job job;
    const auto report = prune(bundle, {}, job);
    ASSERT_TRUE(report) << report.error().text();
    EXPECT_EQ(report->keptPixels, bundle.pointCount());
    EXPECT_TRUE(bundle.check());
}

TEST(Prune, ViewsOneByOneAreThoseOfABundle) {
    const Bundle whole = torusViews(96);
    for (const bool linear : {false, true}) {
        Bundle before = whole;
        // A gap, so that blocks without points have neighbours with some.
        for (int x = 30; x < 60; ++x) before.views[2].depth.at(x, 40) = kNoDepth;
        if (linear)
            for (ReferenceView& view : before.views) {
                RgbaFloatImage colour(96, 96);
                for (std::size_t k = 0; k < colour.count(); ++k)
                    colour.data()[k] = view.texture.at(k);
                view.texture = std::move(colour);
            }
        Job job;
        Bundle after = before;
        PruneSettings settings;
        settings.overlap = 1;
        const auto report = prune(after, settings, job);
        ASSERT_TRUE(report);
        auto pruning = findPruning(*viewsOf(before), settings, job);
        ASSERT_TRUE(pruning);
        EXPECT_EQ(pruning->report.keptPixels, report->keptPixels);
        EXPECT_EQ(pruning->report.psnr, report->psnr);
        EXPECT_LT(report->keptPixels, report->sourcePixels);
        const auto table = prunedViews(tableOf(before), std::move(*pruning));
        for (std::size_t i = 0; i < before.views.size(); ++i) {
            const auto view = table->view(i, job);
            ASSERT_TRUE(view) << view.error().text();
            EXPECT_EQ((*view)->pruned, after.views[i].pruned);
            EXPECT_EQ((*view)->depth, after.views[i].depth);
            EXPECT_TRUE((*view)->texture == after.views[i].texture);
        }
        PackSettings tight;
        tight.layout = PackSettings::Layout::tight;
        const auto a = pack(*table, tight, job), b = pack(after, tight, job);
        ASSERT_TRUE(a && b);
        EXPECT_EQ(a->pages[0].depth, b->pages[0].depth);
        EXPECT_TRUE(a->pages[0].texture == b->pages[0].texture);
        EXPECT_EQ(a->keptPixels, b->keptPixels);
        EXPECT_EQ(a->sourcePixels, b->sourcePixels);
    }
}

/// Views of which one turns out to be other than its header.
class ViewsThatLie : public ViewTable {
  public:
    explicit ViewsThatLie(Bundle bundle)
        : ViewTable(bundle, std::vector<ViewImageKinds>(bundle.views.size())),
          bundle_(std::move(bundle)) {
        for (ReferenceView& view : about().views) view.texture = {}, view.depth = {};
    }

  protected:
    Result<std::shared_ptr<const ReferenceView>> make(std::size_t index, Job&) const override {
        auto view = std::make_shared<ReferenceView>(bundle_.views[index]);
        if (index == 3) view->farPlane *= 2;
        return view;
    }

  private:
    Bundle bundle_;
};

TEST(Prune, ViewsThatAreNotThoseOfTheirHeadersAreErrors) {
    const ViewsThatLie table(torusViews(48));
    Job job;
    const auto pruning = findPruning(table, {}, job);
    ASSERT_FALSE(pruning);
    EXPECT_EQ(pruning.error().where, "view 3");
    const auto atlas = pack(table, {}, job);
    ASSERT_FALSE(atlas);
    EXPECT_EQ(atlas.error().where, "view 3");
}

TEST(Prune, SameOnAnyNumberOfThreads) {
    Bundle one = torusViews(), many = one;
    Job job;
    PruneSettings settings;
    settings.budget = one.pointCount() / 2;
    {
        const ThreadLimit limit(1);
        ASSERT_TRUE(prune(one, settings, job));
    }
    const ThreadLimit limit(6);
    ASSERT_TRUE(prune(many, settings, job));
    for (std::size_t i = 0; i < one.views.size(); ++i) {
        EXPECT_EQ(one.views[i].depth, many.views[i].depth);
        EXPECT_EQ(one.views[i].texture, many.views[i].texture);
    }
}

TEST(Prune, RefusesNonsense) {
    Job job;
    Bundle bundle;
    EXPECT_FALSE(prune(bundle, {}, job));
    bundle = torusViews();
    PruneSettings settings;
    settings.budget = -1;
    EXPECT_FALSE(prune(bundle, settings, job));
    settings.budget = 0;
    settings.minPsnr = std::nan("");
    EXPECT_FALSE(prune(bundle, settings, job));
    settings.minPsnr = 0;
    settings.rateTolerance = 0.5;
    EXPECT_FALSE(prune(bundle, settings, job));
}

TEST(Prune, SpheresAt31PercentStayAbove43Decibels) {
    REQUIRE_SHARED(folder, "data/imagesets/spheres-miv");
    const Camera camera = spheres::cameraNamed(spheres::cameras(folder), "gt_center");
    auto bundle = spheres::bundle(folder);
    PruneSettings settings;
    settings.budget = bundle.pointCount() * 31 / 100;
    Job job;
    const auto report = prune(bundle, settings, job);
    ASSERT_TRUE(report) << report.error().text();
    EXPECT_LE(report->keptPixels, settings.budget);
    const auto truth = spheres::picture(folder / "gt_center_color.png");
    const Frame frame = draw(bundle, camera);
    Rgba8Image picture(camera.width, camera.height);
    for (std::size_t i = 0; i < picture.count(); ++i)
        picture.pixels()[i] =
            glm::u8vec4(glm::clamp(frame.colour.pixels()[i], 0.0f, 1.0f) * 255.0f + 0.5f);
    const auto difference = compare(picture, truth);
    ASSERT_TRUE(difference);
    fmt::print(
        "spheres-miv, {:.1f} % kept: center {:.2f} dB Y\n",
        100.0 * static_cast<double>(report->keptPixels) / static_cast<double>(report->sourcePixels),
        *difference->psnrY);
    EXPECT_GT(*difference->psnrY, 43);
}

}  // namespace
}  // namespace stx
