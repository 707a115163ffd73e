// Sources whose colours differ as those of cameras do that expose for themselves: what is found of
// it, what is changed, and that nothing is where the sources agree.

#include "lib/refine/colour_match.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "lib/base/job.hpp"
#include "lib/packing/packing.hpp"
#include "lib/refine/exposure.hpp"
#include "lib/render/bench/analytic_scene.hpp"
#include "lib/render/factory.hpp"
#include "lib/render/scene/page_set.hpp"
#include "tests/noisy_depth.hpp"
#include "tests/torus_bundle.hpp"

namespace stx {
namespace {

constexpr int kViews = 6;
constexpr std::size_t kChanged = 3;

/// Pairs of neighbouring views. Colours of all but view kChanged are those of the surface, with a
/// little noise; every sixth pair shows something else.
std::vector<SharedColours> pairsOf(glm::vec3 gain, glm::vec3 offset) {
    std::vector<SharedColours> pairs;
    for (std::size_t a = 0; a < kViews; ++a) {
        for (std::size_t b = a + 1; b < std::min<std::size_t>(a + 3, kViews); ++b) {
            SharedColours pair{a, b, {}};
            for (std::uint64_t k = 0; k < 300; ++k) {
                const auto at = [&](std::uint64_t what) {
                    return static_cast<float>(noisy::uniform(a * 16 + b, k, what));
                };
                const auto seen = [&](std::size_t view, glm::vec3 c) {
                    const float noise = 0.01f * (at(10 + view) - 0.5f);
                    return (view == kChanged ? gain * c + offset : c) + noise;
                };
                const glm::vec3 c = 0.2f + 0.6f * glm::vec3(at(0), at(1), at(2));
                const glm::vec3 other = k % 6 == 0 ? 0.2f + 0.6f * glm::vec3(at(3)) : c;
                pair.points.push_back({seen(a, c), seen(b, other)});
            }
            pairs.push_back(pair);
        }
    }
    return pairs;
}

TEST(ColourMatch, OneViewOfOtherLightComesBack) {
    const glm::vec3 gain(0.9f, 0.88f, 1.05f), offset(0.02f, 0.0f, -0.01f);
    const auto maps = matchColours(kViews, pairsOf(gain, offset));
    ASSERT_EQ(maps.size(), std::size_t{kViews});
    for (std::size_t v = 0; v < maps.size(); ++v) {
        for (const float value : {0.25f, 0.5f, 0.75f}) {
            const glm::vec3 c(value);
            const glm::vec3 back = maps[v](v == kChanged ? gain * c + offset : c);
            for (int k = 0; k < 3; ++k) EXPECT_NEAR(back[k], value, 1.0 / 255) << v << " " << k;
        }
    }
}

TEST(ColourMatch, ViewsThatAgreeKeepTheirColours) {
    for (const float gain : {1.0f, 1.002f})
        for (const ColourMap& map : matchColours(kViews, pairsOf(glm::vec3(gain), glm::vec3(0))))
            EXPECT_TRUE(map.changesNothing());
}

TEST(ColourMatch, WhatGrowsSlowlyIsUndoneWithoutAJump) {
    float before = 0;
    bool some = false, none = false;
    for (float gain = 1.0f; gain > 0.9f; gain -= 0.0025f) {
        const auto maps = matchColours(kViews, pairsOf(glm::vec3(gain), glm::vec3(0)));
        const float undone = maps[kChanged](glm::vec3(0.6f)).x - 0.6f;
        // A step is 0.4 steps of 8 bits at 0.6; as long as the map grows, it makes up for others.
        EXPECT_LT(std::abs(undone - before), 2.0f / 255) << gain;
        before = undone;
        none = none || undone == 0;
        some = some || undone > 8.0f / 255;
    }
    EXPECT_TRUE(none && some);
}

TEST(ColourMatch, FewColoursTellNothing) {
    EXPECT_TRUE(matchColours(2, {})[0].changesNothing());
    std::vector<SharedColours> few(1);
    few[0] = {0, 1, std::vector<LitPair>(20, {glm::vec3(0.3f), glm::vec3(0.6f)})};
    EXPECT_TRUE(matchColours(2, few)[1].changesNothing());
}

/// The mean difference of the colours of a view's points from those of another bundle, steps.
double difference(const PageSet& set, const Bundle& truth, std::size_t view) {
    double sum = 0;
    int count = 0;
    const Texture& texture = *set.pages()[view].texture;
    for (std::size_t i = 0; i < truth.views[view].depth.count(); ++i) {
        const glm::vec4 c = truth.views[view].texture.at(i);
        if (!hasPoint(truth.views[view].depth.data()[i]) || c.a < 1) continue;
        const glm::vec3 d = glm::abs(glm::vec3(texture.at(i) - c));
        sum += 255 * (d.x + d.y + d.z) / 3;
        ++count;
    }
    return sum / count;
}

class MatchedScenes : public testing::TestWithParam<AnalyticScene> {
  protected:
    Bundle exact = analyticBundle(GetParam(), 6);
};

TEST_P(MatchedScenes, ExactViewsAreTheVerySame) {
    const PageSet set(exact);
    RefineStepReport report;
    const PageSet same = set.inOneLight({}, report);
    EXPECT_EQ(report.views, 0);
    for (std::size_t i = 0; i < exact.views.size(); ++i) {
        EXPECT_EQ(same.pages()[i].texture, &exact.views[i].texture);
        EXPECT_EQ(&same.captured(i), &exact.views[i].texture);
    }
}

TEST_P(MatchedScenes, ADarkenedViewComesBack) {
    Bundle bundle = exact;
    auto* bytes = bundle.views[2].texture.rgba8();
    ASSERT_TRUE(bytes);
    for (auto& c : bytes->pixels()) {
        const glm::vec3 dark = 0.9f * glm::vec3(c) + 5.0f;
        if (c.a > 0) c = glm::u8vec4(glm::u8vec3(dark + 0.5f), c.a);
    }
    const PageSet set(bundle);
    RefineStepReport report;
    const PageSet matched = set.inOneLight({}, report);
    EXPECT_GE(report.views, 1);
    EXPECT_GT(difference(set, exact, 2), 5);
    for (std::size_t v = 0; v < exact.views.size(); ++v)
        EXPECT_LT(difference(matched, exact, v), 2);
    EXPECT_EQ(&matched.captured(2), &bundle.views[2].texture);
}

INSTANTIATE_TEST_SUITE_P(Scenes, MatchedScenes,
                         testing::Values(AnalyticScene::object, AnalyticScene::room),
                         [](const auto& scene) {
                             return scene.param == AnalyticScene::object ? "object" : "room";
                         });

TEST(MatchedAtlas, IsMatchedAsItsViewsAre) {
    Bundle bundle = analyticBundle(AnalyticScene::object, 6);
    noisy::changeLight(bundle);
    Job job;
    const auto atlas = pack(bundle, {}, job);
    ASSERT_TRUE(atlas) << atlas.error().text();
    const auto packed = PageSet::of(*atlas, job);
    ASSERT_TRUE(packed);
    RefineStepReport ofViews, ofAtlas;
    const PageSet a = PageSet(bundle).inOneLight({}, ofViews);
    const PageSet b = packed->inOneLight({}, ofAtlas);
    EXPECT_GT(ofViews.views, 0);
    EXPECT_EQ(ofViews.views, ofAtlas.views);
    int compared = 0;
    for (std::size_t v = 0; v < bundle.views.size(); ++v) {
        for (int y = 5; y < 256; y += 10) {
            for (int x = 5; x < 256; x += 10) {
                const PageRectangle* r = b.find(v, x, y);
                if (!r || !hasPoint(bundle.views[v].depth.at(x, y))) continue;
                const glm::vec4 there =
                    b.pages()[static_cast<std::size_t>(r->page)].texture->at(r->texel(x, y));
                const glm::vec4 here = a.pages()[v].texture->at(x, y);
                for (int k = 0; k < 4; ++k) EXPECT_NEAR(there[k], here[k], 1.1 / 255);
                ++compared;
            }
        }
    }
    EXPECT_GT(compared, 100);
}

TEST(MatchedPictures, AViewsOwnCameraGivesItsOwnColours) {
    Bundle bundle = analyticBundle(AnalyticScene::object, 6);
    noisy::changeLight(bundle);
    Job job;
    const auto pictureAt = [&](const Camera& camera, bool match) {
        RenderSettings settings;
        settings.refine.set(RefineStep::exposure, match);
        const auto renderer = makeRenderer(Backend::cpu, bundle, settings, -1, job);
        return (*renderer)->render(camera)->colour;
    };
    const Camera& own = bundle.views[1].camera;
    EXPECT_EQ(pictureAt(own, true), pictureAt(own, false));
    EXPECT_EQ(job.takeNotes().size(), 1u);
    const Camera between = analyticCamera(AnalyticScene::object, 0.5, 6);
    EXPECT_NE(pictureAt(between, true), pictureAt(between, false));
}

/// How often views are looked at that are not all there at a time; the maps are those of all views
/// in memory.
int looksAt(const Bundle& bundle) {
    std::vector<Camera> cameras;
    for (const ReferenceView& view : bundle.views) cameras.push_back(view.camera);
    const auto partOf = [&](std::size_t k, int, int, int, int) {
        const ReferenceView& view = bundle.views[k];
        return PixelPart{&view.texture, &view.depth, 0, 1, view.camera.width};
    };
    int looks = 0;
    const auto each = [&](const std::function<void(std::size_t)>& body) -> Result<bool> {
        ++looks;
        for (std::size_t v = 0; v < cameras.size(); ++v) body(v);
        return true;
    };
    const auto found = exposureMaps(cameras, partOf, each);
    const auto expected = exposureMaps(cameras, partOf);
    if (!found || !*found) {
        ADD_FAILURE() << "no maps";
        return looks;
    }
    for (std::size_t v = 0; v < expected.size(); ++v) {
        EXPECT_EQ((**found)[v].gain, expected[v].gain) << v;
        EXPECT_EQ((**found)[v].offset, expected[v].offset) << v;
    }
    // One view is darker, and is found.
    EXPECT_FALSE(expected[1].changesNothing());
    return looks;
}

TEST(Exposure, ViewsAreReadTwice) {
    for (const int views : {10, 200}) {
        Bundle bundle = torusViews(64, glm::dvec3(0), {ViewLayout::Kind::sphere, views, 0});
        for (glm::u8vec4& c : bundle.views[1].texture.rgba8()->pixels())
            c = glm::u8vec4(glm::u8vec3(0.8f * glm::vec3(c) + 0.5f), c.a);
        // What so many views show of each other is too much to keep.
        EXPECT_EQ(looksAt(bundle), views == 10 ? 2 : 3) << views;
    }
}

TEST(Exposure, FromFarAwayWhatIsBehindASurfaceIsAnother) {
    // A camera far away shows a wall, one between the two shows a darker wall one unit behind it.
    Bundle bundle;
    for (const auto& [distance, brightness] : {std::pair(100.0, 200.0f), std::pair(0.5, 120.0f)}) {
        ReferenceView& view = bundle.views.emplace_back();
        Camera& c = view.camera;
        c.width = c.height = 64;
        c.fx = c.fy = 16 * distance;
        c.cx = c.cy = 32;
        c.position.z = distance > 1 ? distance : -0.5;
        view.depth = Image<float>(64, 64, static_cast<float>(distance));
        Rgba8Image colours(64, 64);
        for (int i = 0; i < 64 * 64; ++i) {
            const auto change = [&](int period) { return static_cast<float>(i / period % 8) / 16; };
            colours.data()[i] = glm::u8vec4(
                glm::u8vec3(brightness * glm::vec3(0.5f + change(8), 0.5f + change(512), 0.7f)),
                255);
        }
        view.texture = std::move(colours);
    }
    RefineStepReport report;
    (void)PageSet(bundle).inOneLight({}, report);
    EXPECT_EQ(report.views, 0);
}

TEST(Exposure, WhoReadsViewsMayEndIt) {
    const Bundle bundle = torusViews(64);
    std::vector<Camera> cameras;
    for (const ReferenceView& view : bundle.views) cameras.push_back(view.camera);
    const auto partOf = [&](std::size_t k, int, int, int, int) {
        const ReferenceView& view = bundle.views[k];
        return PixelPart{&view.texture, &view.depth, 0, 1, view.camera.width};
    };
    for (const int ended : {1, 2}) {
        int looks = 0;
        const auto each = [&](const std::function<void(std::size_t)>& body) -> Result<bool> {
            for (std::size_t v = 0; v < cameras.size(); ++v) body(v);
            return ++looks < ended;
        };
        const auto found = exposureMaps(cameras, partOf, each);
        ASSERT_TRUE(found);
        EXPECT_FALSE(*found);
        EXPECT_EQ(looks, ended) << "it is not asked for views again";
    }
}

}  // namespace
}  // namespace stx
