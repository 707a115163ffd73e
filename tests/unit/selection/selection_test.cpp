#include "lib/selection/selection.hpp"

#include <atomic>
#include <random>
#include <set>
#include <utility>

#include <gtest/gtest.h>

#include "lib/base/parallel.hpp"
#include "lib/selection/cover.hpp"
#include "lib/selection/coverage.hpp"
#include "tests/noisy_depth.hpp"
#include "tests/unit/surface/analytic.hpp"

namespace stx {
namespace {

double valueOf(const CoverProblem& p, const std::vector<int>& views) {
    std::vector<float> best(p.weights.size(), 0);
    for (const int v : views) {
        for (const auto& item : p.views[v])
            best[item.sample] = std::max(best[item.sample], item.quality);
    }
    double value = 0;
    for (std::size_t i = 0; i < best.size(); ++i) value += p.weights[i] * best[i];
    return value;
}

CoverProblem randomProblem(unsigned seed, int views, int samples) {
    std::mt19937 random(seed);
    CoverProblem p;
    for (int i = 0; i < samples; ++i) p.weights.push_back(1.0 + random() % 5);
    p.views.resize(views);
    for (auto& v : p.views) {
        for (int i = 0; i < samples; ++i) {
            if (random() % 4 == 0)
                v.push_back(
                    {static_cast<std::uint32_t>(i), static_cast<float>(random() % 100) * 0.01f});
        }
    }
    return p;
}

TEST(Cover, IsNearTheBestAndTheCertificateHolds) {
    for (unsigned seed = 0; seed < 40; ++seed) {
        const int views = 9, pick = 1 + static_cast<int>(seed % 4);
        const auto p = randomProblem(seed, views, 40);
        double optimum = 0;
        for (int mask = 0; mask < 1 << views; ++mask) {
            if (__builtin_popcount(mask) != pick) continue;
            std::vector<int> some;
            for (int v = 0; v < views; ++v) {
                if (mask >> v & 1) some.push_back(v);
            }
            optimum = std::max(optimum, valueOf(p, some));
        }
        const auto s = chooseCover(p, pick, 1.0);
        ASSERT_EQ(s.chosen.size(), static_cast<std::size_t>(pick));
        EXPECT_NEAR(s.values.back(), valueOf(p, s.chosen), 1e-9);
        EXPECT_GE(s.values.back(), 0.95 * optimum);
        EXPECT_LE(s.values.back(), optimum + 1e-9);
        EXPECT_GE(s.bound, optimum - 1e-9) << "the certificate must never promise too much";
    }
}

TEST(Cover, StopsWhenEnoughOrNothingIsAdded) {
    CoverProblem p;
    p.weights = {1, 1, 1, 1};
    p.views = {{{0, 1.0f}, {1, 1.0f}}, {{2, 1.0f}}, {{3, 1.0f}}, {{0, 0.5f}}, {}};
    EXPECT_EQ(chooseCover(p, 5, 1.0).chosen, (std::vector<int>{0, 1, 2}));
    EXPECT_EQ(chooseCover(p, 5, 0.7).chosen, (std::vector<int>{0, 1}));
    EXPECT_EQ(chooseCover(p, 1, 1.0).chosen, (std::vector<int>{0}));
    EXPECT_TRUE(chooseCover({{1.0}, {{}, {}}}, 2, 1.0).chosen.empty());
}

TEST(Cover, AShareIsReachedWithTheFewest) {
    // The largest view comes first and needs both others beside it; those alone show all.
    CoverProblem p;
    p.weights = {1, 1, 1, 1, 1, 1};
    p.views = {{{1, 1.0f}, {2, 1.0f}, {3, 1.0f}, {4, 1.0f}},
               {{0, 1.0f}, {1, 1.0f}, {2, 1.0f}},
               {{3, 1.0f}, {4, 1.0f}, {5, 1.0f}}};
    const auto two = chooseCover(p, 3, 0.99);
    EXPECT_EQ(std::set<int>(two.chosen.begin(), two.chosen.end()), (std::set<int>{1, 2}));
    EXPECT_EQ(two.values, (std::vector<double>{3, 6}));
    EXPECT_DOUBLE_EQ(two.bound, 6) << "of two views";
    for (unsigned seed = 0; seed < 40; ++seed) {
        const auto random = randomProblem(seed, 9, 40);
        const auto s = chooseCover(random, 9, 0.9);
        ASSERT_FALSE(s.chosen.empty());
        EXPECT_GE(s.values.back(), 0.9 * s.all);
        EXPECT_NEAR(s.values.back(), valueOf(random, s.chosen), 1e-9);
        double optimum = 0;
        for (int mask = 0; mask < 1 << 9; ++mask) {
            if (__builtin_popcount(mask) != std::ssize(s.chosen)) continue;
            std::vector<int> some;
            for (int v = 0; v < 9; ++v) {
                if (mask >> v & 1) some.push_back(v);
            }
            optimum = std::max(optimum, valueOf(random, some));
        }
        EXPECT_GE(s.bound, optimum - 1e-9) << "of as many views as there are in the end";
    }
}

TEST(Coverage, SamplesOfABundleAddUpToItsSurface) {
    // A sphere seen from six sides: each bit of surface counts once though three views see it.
    Bundle bundle;
    for (const glm::dvec3 eye : {glm::dvec3(3, 0, 0), glm::dvec3(-3, 0, 0), glm::dvec3(0, 3, 0),
                                 glm::dvec3(0, -3, 0), glm::dvec3(0, 0, 3), glm::dvec3(0, 0, -3)})
        bundle.views.push_back(
            analytic::capture(analytic::sphere, analytic::lookingAt(eye, 128), 16));
    double area = 0;
    for (const auto& s : sampleBundle(bundle, 20000)) area += s.area;
    EXPECT_NEAR(area, 4 * 3.14159265, 0.05 * 4 * 3.14159265);
}

TEST(Coverage, SeeingASurfaceCountsForMostAndSeeingItBetterForTheRest) {
    // A plane seen from four angles at the same distance: each view by itself.
    const SurfaceSample sample{{0, 0, 0}, {0, 0, 1}, 1.0, false};
    std::vector<Image<float>> depths;
    std::vector<CandidateView> views;
    depths.reserve(4);
    for (const double degrees : {0.0, 60.0, 72.0, 84.0}) {
        const double a = degrees * 3.14159265358979 / 180;
        Camera camera = analytic::lookingAt({3 * std::sin(a), 0, 3 * std::cos(a)}, 63);
        depths.emplace_back(63, 63, 3.0f);
        views.push_back({camera, camera, &depths.back(), 0});
    }
    const auto p = coverProblem({sample}, views, 1e-3);
    std::vector<float> quality;
    for (const auto& v : p.views) {
        ASSERT_EQ(v.size(), 1u);
        quality.push_back(v[0].quality);
    }
    EXPECT_NEAR(quality[0], 1.0, 1e-6);
    EXPECT_NEAR(quality[1], 0.95, 1e-6) << "60 degrees is seen well enough";
    EXPECT_NEAR(quality[2], 0.9 * 0.309017 / 0.4 + 0.0309017, 1e-5);
    EXPECT_LT(quality[3], 0.3) << "a glance along a surface is not worth a view";
    const auto coarse = coverProblem({sample}, views, 4 / views[0].camera.sampleSpacing(3).x);
    EXPECT_NEAR(coarse.views[0][0].quality, 0.9 * 0.25 / 0.4 + 0.025, 1e-5)
        << "so is a surface with a quarter of the wanted samples";
}

TEST(Selection, FromABundleDropsWhatAddsNothing) {
    Bundle bundle;
    const std::vector<glm::dvec3> eyes = {{3, 0, 0},  {3, 0.1, 0}, {-3, 0, 0}, {0, 3, 0},
                                          {0, -3, 0}, {0, 0, 3},   {0, 0, -3}, {0.1, 0, -3}};
    for (const auto& eye : eyes)
        bundle.views.push_back(
            analytic::capture(analytic::torus, analytic::lookingAt(eye, 96), 16));
    bundle.views.push_back(bundle.views[0]);
    bundle.views.back().depth = Image<float>(96, 96, kNoDepth);
    Job job;
    SelectSettings settings;
    settings.count = 6;
    const auto s = selectViews(bundle, settings, job);
    ASSERT_TRUE(s) << s.error().text();
    EXPECT_EQ(job.takeNotes(), std::vector<std::string>{"1 of 9 views dropped: they are empty"});
    std::set<int> chosen(s->views.begin(), s->views.end());
    EXPECT_EQ(chosen.size(), 6u);
    EXPECT_LE(chosen.count(0) + chosen.count(1), 1u) << "twins";
    EXPECT_LE(chosen.count(6) + chosen.count(7), 1u) << "twins";
    EXPECT_TRUE(std::is_sorted(s->quality.begin(), s->quality.end()));
    EXPECT_GT(s->quality.back(), 0.99);
    EXPECT_GT(s->certificate, 0.9);
    EXPECT_LE(s->certificate, 1.0);
    EXPECT_GT(s->coverage, 0.99);
    const Bundle kept = keepViews(bundle, s->views);
    EXPECT_EQ(kept.views.size(), 6u);

    settings.count = 0;
    settings.share = 0.5;
    const auto half = selectViews(bundle, settings, job);
    ASSERT_TRUE(half);
    EXPECT_LT(half->views.size(), 5u);
    EXPECT_GE(half->quality.back(), 0.5);
}

// Of noisy views a selection said that it sees 59 % of the surface; of exact ones 98.
TEST(Selection, FromNoisyViewsIsAsFromExactOnes) {
    Bundle exact;
    for (int i = 0; i < 16; ++i) {
        const double a = 2.39996 * i, z = 0.9 - 1.8 * (i + 0.5) / 16, r = std::sqrt(1 - z * z);
        exact.views.push_back(analytic::capture(
            analytic::torus,
            analytic::lookingAt(3.0 * glm::dvec3(r * std::cos(a), r * std::sin(a), z), 128), 32));
    }
    Bundle noisy = exact;
    noisy::addNoise(noisy, 0.02);
    SelectSettings settings;
    settings.count = 4;
    Job job;
    const auto four = selectViews(exact, settings, job),
               fourNoisy = selectViews(noisy, settings, job);
    ASSERT_TRUE(four && fourNoisy);
    EXPECT_NEAR(fourNoisy->coverage, four->coverage, 0.05);
    settings.count = 0;
    const auto some = selectViews(exact, settings, job),
               someNoisy = selectViews(noisy, settings, job);
    ASSERT_TRUE(some && someNoisy);
    EXPECT_LE(someNoisy->views.size(), some->views.size() + 3);
}

/// Gives copies: nothing is held.
class ViewsToSelect : public ViewTable {
  public:
    explicit ViewsToSelect(const Bundle& bundle)
        : ViewTable(headersOf(bundle),
                    std::vector<ViewImageKinds>(bundle.views.size(),
                                                ViewImageKinds::of(bundle.views[0]))),
          bundle_(bundle) {}
    mutable std::atomic<int> asked = 0;

  protected:
    Result<std::shared_ptr<const ReferenceView>> make(std::size_t index, Job&) const override {
        ++asked;
        return std::make_shared<ReferenceView>(bundle_.views[index]);
    }

  private:
    static Bundle headersOf(const Bundle& bundle) {
        Bundle headers;
        for (const ReferenceView& view : bundle.views)
            static_cast<ViewHeader&>(headers.views.emplace_back()) = view;
        return headers;
    }
    const Bundle& bundle_;
};

TEST(Selection, OneByOneIsThatOfAllInMemory) {
    Bundle bundle;
    std::mt19937 random(5);
    const auto side = [&] { return static_cast<double>(random() % 2001) / 1000 - 1; };
    for (int i = 0; i < 12; ++i)
        bundle.views.push_back(analytic::capture(
            analytic::torus,
            analytic::lookingAt(3.0 * glm::normalize(glm::dvec3(side(), side(), side())), 96), 16));
    bundle.views[4].depth = Image<float>(96, 96, kNoDepth);
    for (const auto& [count, noise] : {std::pair(0, 0.0), {1, 0.0}, {5, 0.0}, {5, 0.02}}) {
        noisy::addNoise(bundle, noise);
        const ViewsToSelect table(bundle);
        SelectSettings settings;
        settings.count = count;
        settings.samples = 3000;
        Job job;
        const auto all = selectViews(bundle, settings, job);
        const auto notes = job.takeNotes();
        table.asked = 0;
        std::vector<std::int64_t> told;
        job.onProgress = [&](std::int64_t done, std::int64_t total, std::string_view what) {
            EXPECT_EQ(total, 12);
            EXPECT_EQ(what, "looking at what views see");
            told.push_back(done);
        };
        const auto each = selectViews(table, settings, job);
        job.onProgress = nullptr;
        ASSERT_EQ(told.size(), 12u);
        EXPECT_TRUE(std::ranges::is_sorted(told));
        ASSERT_TRUE(all && each);
        EXPECT_EQ(job.takeNotes(), notes);
        EXPECT_EQ(table.asked, 3 * 12);
        EXPECT_EQ(each->views, all->views);
        EXPECT_EQ(each->quality, all->quality);
        EXPECT_EQ(each->certificate, all->certificate);
        EXPECT_EQ(each->coverage, all->coverage);
        EXPECT_EQ(each->coverageOfAll, all->coverageOfAll);
    }
    Job job;
    job.limits.maxMemoryBytes = 96 * 96 * 20;
    const auto refused = selectViews(ViewsToSelect(bundle), {}, job);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::invalidInput);
}

TEST(Selection, ViewsThatShareNothingAreAllKept) {
    Bundle bundle;
    for (int i = 0; i < 5; ++i) {
        auto v = analytic::capture(analytic::sphere, analytic::lookingAt({0, 0, 3}, 32), 16);
        v.camera.position.x += 100.0 * i;
        bundle.views.push_back(std::move(v));
    }
    Job job;
    const auto s = selectViews(bundle, {}, job);
    ASSERT_TRUE(s);
    EXPECT_EQ(s->views.size(), 5u);
    EXPECT_DOUBLE_EQ(s->coverage, 1.0);
}

/// Distances that are lost beside the camera's position when a point is formed: no view sees any.
TEST(Selection, OfPointsThatNoViewSeesIsRefused) {
    Bundle bundle;
    auto view = analytic::capture(analytic::sphere, analytic::lookingAt({0, 0, 3}, 32), 32);
    for (std::size_t i = 0; i < view.depth.count(); ++i)
        if (hasPoint(view.depth.data()[i])) view.depth.data()[i] = 1e-20f;
    view.nearPlane = 1e-21;
    view.farPlane = 1e-19;
    bundle.views.push_back(view);
    bundle.views.push_back(view);
    Job job;
    const auto refused = selectViews(bundle, {}, job);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::failed);
    EXPECT_NE(refused.error().message.find("none of the 2 views"), std::string::npos)
        << refused.error().message;
    EXPECT_FALSE(selectViews(*viewsOf(bundle), {}, job));
}

/// A box open on one side that holds another, closed box: the inner one's surface is never seen.
Mesh boxInBox() {
    Mesh mesh;
    mesh.materials.emplace_back();
    const auto addBox = [&](float half, float z) {
        const auto base = static_cast<std::uint32_t>(mesh.positions.size());
        for (int k = 0; k < 8; ++k)
            mesh.positions.emplace_back(k & 1 ? half : -half, k & 2 ? half : -half,
                                        (k & 4 ? half : -half) + z);
        const std::uint32_t quads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                           {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
        for (const auto& q : quads) {
            mesh.triangles.emplace_back(base + q[0], base + q[1], base + q[2]);
            mesh.triangles.emplace_back(base + q[0], base + q[2], base + q[3]);
        }
    };
    addBox(1.0f, 0);
    addBox(0.5f, 0);
    mesh.triangleMaterial.assign(mesh.triangles.size(), 0);
    return mesh;
}

TEST(Selection, AroundAMeshSixFacesAndTheCavity) {
    const Mesh mesh = boxInBox();
    Job job;
    MeshCandidates candidates;
    candidates.directions = 100;
    SelectSettings settings;
    settings.samples = 5000;
    settings.count = 8;
    const auto s = selectMeshViews(mesh, candidates, settings, job);
    ASSERT_TRUE(s) << s.error().text();
    EXPECT_EQ(s->cameras.size(), 8u);
    EXPECT_NEAR(s->selection.neverSeen, 0.2, 0.01) << "6 * 1 of 6 * 1 + 6 * 4";
    EXPECT_NEAR(s->selection.coverage, 0.8, 0.01);
    EXPECT_GT(s->selection.certificate, 0.8);
    for (const auto& c : s->cameras) EXPECT_TRUE(c.check());
    const auto svg = selectionPlotSvg(s->selection, "a <box> & more");
    EXPECT_NE(svg.find("a &lt;box&gt; &amp; more"), std::string::npos);
    EXPECT_NE(svg.find("</svg>"), std::string::npos);
}

/// A box without a lid, of sheets without thickness. Each sheet was seen as soon as either side
/// was: views from below alone saw "100 % of the surface", and pictures from above had 3 dB.
TEST(Selection, BothSidesOfASheetAreLookedAt) {
    Mesh mesh = boxInBox();
    mesh.triangles.resize(12);
    mesh.triangles.erase(mesh.triangles.begin() + 6, mesh.triangles.begin() + 8);  // +Y
    mesh.triangleMaterial.assign(mesh.triangles.size(), 0);
    Job job;
    SelectSettings settings;
    settings.samples = 5000;
    settings.count = 8;
    const auto s = selectMeshViews(mesh, {}, settings, job);
    ASSERT_TRUE(s) << s.error().text();
    EXPECT_GT(s->selection.coverage, 0.99);
    EXPECT_LT(s->selection.neverSeen, 0.01);
    const auto from = [&](double least, double most) {
        return std::ranges::count_if(s->cameras, [&](const Camera& c) {
            const double up = c.position.y / glm::length(c.position);
            return up > least && up < most;
        });
    };
    EXPECT_GE(from(0.5, 1), 3);
    EXPECT_GE(from(-1, 0), 2);
}

TEST(Selection, SameOnAnyNumberOfThreads) {
    const Mesh mesh = boxInBox();
    Job job;
    MeshCandidates candidates;
    candidates.directions = 40;
    SelectSettings settings;
    settings.samples = 2000;
    settings.count = 5;
    const auto on = [&](int threads) {
        const ThreadLimit limit(threads);
        return selectMeshViews(mesh, candidates, settings, job);
    };
    const auto a = on(1), b = on(5);
    ASSERT_TRUE(a && b);
    EXPECT_EQ(a->selection.views, b->selection.views);
    EXPECT_EQ(a->selection.quality, b->selection.quality);
    EXPECT_EQ(a->selection.certificate, b->selection.certificate);
}

TEST(Selection, LeastViewsBisects) {
    int calls = 0;
    const auto measure = [&](int n) -> Result<double> {
        ++calls;
        return 20.0 + n;
    };
    EXPECT_EQ(*leastViews(64, 31.0, measure), 11);
    EXPECT_LT(calls, 10);
    EXPECT_EQ(*leastViews(8, 99.0, measure), 8);
    EXPECT_EQ(*leastViews(8, 5.0, measure), 1);
    EXPECT_FALSE(
        leastViews(8, 5.0, [](int) -> Result<double> { return fail(ErrorCode::failed, "no"); }));
    EXPECT_FALSE(leastViews(0, 5.0, measure));
}

TEST(Selection, RefusesNonsense) {
    Job job;
    Bundle bundle;
    EXPECT_FALSE(selectViews(bundle, {}, job));
    bundle.views.push_back(
        analytic::capture(analytic::sphere, analytic::lookingAt({0, 0, 3}, 16), 16));
    SelectSettings settings;
    settings.count = -1;
    EXPECT_FALSE(selectViews(bundle, settings, job));
    settings.count = 0;
    settings.share = std::nan("");
    EXPECT_FALSE(selectViews(bundle, settings, job));
    bundle.views[0].depth = Image<float>(16, 16, kNoDepth);
    EXPECT_FALSE(selectViews(bundle, {}, job));
    EXPECT_FALSE(selectMeshViews(Mesh{}, {}, {}, job));
    MeshCandidates candidates;
    candidates.directions = 0;
    EXPECT_FALSE(selectMeshViews(boxInBox(), candidates, {}, job));
}

}  // namespace
}  // namespace stx
