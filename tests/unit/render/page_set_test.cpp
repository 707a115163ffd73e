#include "lib/render/scene/page_set.hpp"

#include <gtest/gtest.h>

#include "lib/metrics/compare.hpp"
#include "lib/model/view_table.hpp"
#include "lib/packing/packing.hpp"
#include "lib/packing/prune.hpp"
#include "lib/render/factory.hpp"
#include "lib/surface/normals.hpp"
#include "tests/torus_bundle.hpp"
#include "tests/unit/surface/analytic.hpp"

namespace stx {
namespace {

struct Case {
    const char* name;
    PackSettings::Layout layout;
    bool pruned, baked;
    int padding = 2;
};

std::ostream& operator<<(std::ostream& out, const Case& c) {
    return out << c.name;
}

class PageSets : public testing::TestWithParam<Case> {
  protected:
    void SetUp() override {
        Bundle bundle = torusViews(128);
        if (GetParam().baked) {
            ASSERT_TRUE(bake(bundle, {}, job));
        }
        PackSettings settings;
        settings.layout = GetParam().layout;
        settings.padding = GetParam().padding;
        if (GetParam().pruned) {
            const auto report = prune(bundle, {}, job);
            ASSERT_TRUE(report);
            settings.sourcePixels = report->sourcePixels;
        }
        auto packed = pack(bundle, settings, job);
        ASSERT_TRUE(packed) << packed.error().text();
        atlas = std::move(*packed);
        auto unpacked = unpack(atlas, job);
        ASSERT_TRUE(unpacked);
        views = std::move(*unpacked);
    }

    Job job;
    Atlas atlas;
    Bundle views;
};

TEST_P(PageSets, GiveThePixelsThatUnpackingGives) {
    const auto set = PageSet::of(atlas, job);
    ASSERT_TRUE(set);
    if (GetParam().padding >= PageSet::kPadding) {
        EXPECT_EQ(set->pages()[0].texture, &atlas.pages[0].texture) << "a copy was made";
    }
    EXPECT_EQ(set->pruned(), GetParam().pruned);
    EXPECT_EQ(set->pointCount(), views.pointCount());
    ASSERT_EQ(set->views().size(), views.views.size());
    for (std::size_t v = 0; v < views.views.size(); ++v) {
        const ReferenceView& view = views.views[v];
        EXPECT_EQ(set->views()[v].hasNormals, view.hasNormals());
        const ReferenceView copy = set->copyOfView(v);
        EXPECT_EQ(copy.depth, view.depth);
        EXPECT_EQ(copy.normal, view.normal);
        EXPECT_EQ(copy.pruned, view.pruned);
        int wrong = 0;
        for (int y = 0; y < view.camera.height; ++y) {
            for (int x = 0; x < view.camera.width; ++x) {
                const float alpha = view.texture.at(x, y).a;
                wrong += set->alpha(v, x, y) != alpha || copy.texture.at(x, y).a != alpha;
                wrong += set->depth(v, x, y) != view.depth.at(x, y);
                if (alpha > 0 && hasPoint(view.depth.at(x, y)))
                    wrong += copy.texture.at(x, y) != view.texture.at(x, y);
            }
        }
        EXPECT_EQ(wrong, 0) << "view " << v;
    }
}

/// A texel of a rectangle is seen by its window's camera as the view's camera sees its pixel.
TEST_P(PageSets, HaveRectanglesThatAreViewsOfTheirOwn) {
    const auto set = PageSet::of(atlas, job);
    ASSERT_TRUE(set);
    for (const PageRectangle& r : set->rectangles()) {
        const Camera& view = set->views()[static_cast<std::size_t>(r.view)].camera;
        const Camera& window = r.window;
        const Page& page = set->pages()[static_cast<std::size_t>(r.page)];
        for (const glm::ivec2 at :
             {glm::ivec2(r.x0, r.y0), glm::ivec2(r.x1 - 1, r.y0), glm::ivec2(r.x0, r.y1 - 1)}) {
            const auto texel = static_cast<int>(r.texel(at.x, at.y));
            const int i = texel % page.width() - r.pageX, j = texel / page.width() - r.pageY;
            ASSERT_TRUE(i >= 0 && j >= 0 && i < r.width && j < r.height);
            const glm::dvec3 a =
                view.position + view.orientation * view.unproject(at.x + 0.5, at.y + 0.5, 3);
            const glm::dvec3 b =
                window.position + window.orientation * window.unproject(i + 0.5, j + 0.5, 3);
            EXPECT_LT(glm::distance(a, b), 1e-9);
        }
    }
}

TEST_P(PageSets, AreDrawnLikeTheViews) {
    struct Way {
        RenderMode mode;
        SplatRule splat;
        bool lit;
        double least;  ///< dB; splats are planned in blocks of a rectangle, not of the view
    };
    for (const Way way : {Way{RenderMode::splat, SplatRule::point, false, 80},
                          Way{RenderMode::splat, SplatRule::data, false, 44},
                          Way{RenderMode::splat, SplatRule::paper, false, 55},
                          Way{RenderMode::surface, SplatRule::data, false, 60},
                          Way{RenderMode::surface, SplatRule::data, true, 60}}) {
        RenderSettings settings;
        settings.mode = way.mode;
        settings.splat = way.splat;
        settings.splatCoefficient = 6;
        if (way.lit) settings.lighting.lights.emplace_back();
        const auto fromTextures = makeRenderer(Backend::cpu, atlas, settings, -1, job);
        const auto fromViews = makeRenderer(Backend::cpu, views, settings, -1, job);
        ASSERT_TRUE(fromTextures && fromViews);
        for (const glm::dvec3 eye : {glm::dvec3(1, 2, 2), glm::dvec3(-2, 1, 2)}) {
            const Camera camera = analytic::lookingAt(eye, 128);
            const auto a = (*fromTextures)->render(camera), b = (*fromViews)->render(camera);
            ASSERT_TRUE(a && b);
            const auto difference = compare(a->colour, b->colour);
            ASSERT_TRUE(difference);
            EXPECT_GE(difference->psnrRgb.value_or(100), way.least)
                << "mode " << static_cast<int>(way.mode) << ", rule " << static_cast<int>(way.splat)
                << (way.lit ? ", lit" : "");
        }
    }
}

/// Own poses come back as they are.
TEST_P(PageSets, GiveBackTheirViews) {
    if (GetParam().pruned) GTEST_SKIP() << "pruned views have no whole picture";
    const auto renderer = makeRenderer(Backend::cpu, atlas, {}, -1, job);
    ASSERT_TRUE(renderer);
    const auto frame = (*renderer)->render(views.views[3].camera);
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->depth, views.views[3].depth);
}

/// As bundles are: those without room around their rectangles are made into one first.
TEST_P(PageSets, AreHeldToTheMemoryLimit) {
    const bool fewer = GetParam().pruned || GetParam().layout == PackSettings::Layout::tight;
    if (fewer && GetParam().padding >= PageSet::kPadding)
        GTEST_SKIP() << "these pages take less than the views";
    const auto pixels = static_cast<std::uint64_t>(views.views.size()) * 128 * 128;
    job.limits.maxMemoryBytes = pixels * (ViewImageKinds::of(views.views[0]).bytesPerPixel() + 2);
    const auto renderer = makeRenderer(Backend::cpu, atlas, {}, -1, job);
    ASSERT_FALSE(renderer);
    EXPECT_TRUE(renderer.error().message.starts_with("drawing with views of "))
        << renderer.error().message;
    job.limits.maxMemoryBytes *= 4;
    EXPECT_TRUE(makeRenderer(Backend::cpu, atlas, {}, -1, job));
}

/// Walls with a pane of half alpha, from three places; one camera saw them darker.
TEST(PageSet, WhatIsMadeOpaqueStaysSoAtItsOwnPoseWhenColoursWereMatched) {
    constexpr int kSide = 64;
    Bundle bundle;
    for (const double x : {0.0, 0.2, -0.2}) {
        ReferenceView& view = bundle.views.emplace_back();
        view.name = fmt::format("{}", x);
        view.camera.position = {x, 0, 4};
        view.camera.width = view.camera.height = kSide;
        view.camera.fx = view.camera.fy = kSide;
        view.camera.cx = view.camera.cy = kSide / 2.0;
        view.nearPlane = 3.9;
        view.farPlane = 4.1;
        view.depth = Image<float>(kSide, kSide, 4.0f);
        view.texture = Rgba8Image(kSide, kSide);
        for (int v = 0; v < kSide; ++v) {
            for (int u = 0; u < kSide; ++u) {
                const glm::dvec3 at = view.worldPoint(u, v);
                const glm::dvec3 colour(120 + 60 * std::sin(5 * at.x),
                                        120 + 60 * std::cos(4 * at.y),
                                        100 + 50 * std::sin(3 * (at.x + at.y)));
                const bool pane = u >= 20 && u < 44 && v >= 20 && v < 44;
                view.texture.rgba8()->at(u, v) =
                    glm::u8vec4(glm::u8vec3(colour * (x > 0 ? 0.7 : 1.0)), pane ? 128 : 255);
            }
        }
    }
    Job job;
    RefineStepReport report;
    (void)PageSet(bundle).inOneLight({}, report);
    ASSERT_GT(report.views, 0);
    const auto renderer = makeRenderer(Backend::cpu, bundle, {}, -1, job);
    ASSERT_TRUE(renderer);
    for (const ReferenceView& view : bundle.views) {
        const auto frame = (*renderer)->render(view.camera);
        ASSERT_TRUE(frame);
        const glm::vec4 own = view.texture.at(32, 32), drawn = frame->colour.at(32, 32);
        EXPECT_LT(glm::distance(drawn, glm::vec4(glm::vec3(own), 1.0f)), 1e-5f) << view.name;
    }
}

constexpr auto kGrid = PackSettings::Layout::grid, kTight = PackSettings::Layout::tight;
INSTANTIATE_TEST_SUITE_P(Layouts, PageSets,
                         testing::Values(Case{"grid", kGrid, false, false},
                                         Case{"tight", kTight, false, true},
                                         Case{"prunedGrid", kGrid, true, false},
                                         Case{"prunedTight", kTight, true, false},
                                         Case{"narrow", kTight, true, false, 1}),
                         [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace
}  // namespace stx
