// Which views a picture needs, and that the others need not be there.
#include "lib/render/surface/plan/needed_views.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "lib/render/factory.hpp"
#include "tests/some_views.hpp"

namespace stx {
namespace {

constexpr double kBetween = 1.0;  // of cameras along the wall, scene units
constexpr int kViews = 24, kSize = 160;

/// Looks at the wall z = 0 from (x, 0, 2), a little to the side.
Camera before(double x, double turn = 0) {
    Camera camera;
    camera.position = {x, 0, 2};
    camera.orientation = glm::angleAxis(turn, glm::dvec3(0, 1, 0));
    camera.width = camera.height = kSize;
    camera.fx = camera.fy = kSize;
    camera.cx = camera.cy = kSize / 2.0;
    return camera;
}

/// A wall in waves with a texture, as far as a camera sees.
ReferenceView viewOf(const Camera& camera) {
    ReferenceView view;
    view.camera = camera;
    view.depthBits = 32;
    view.nearPlane = 1.5;
    view.farPlane = 2.4;
    view.texture = Rgba8Image(camera.width, camera.height, glm::u8vec4(255));
    view.depth = Image<float>(camera.width, camera.height);
    for (int y = 0; y < camera.height; ++y) {
        for (int x = 0; x < camera.width; ++x) {
            const glm::dvec3 ray =
                camera.orientation * camera.unproject(x + 0.5, y + 0.5, 1.0);  // z = 1 ahead
            glm::dvec3 at(0);
            double dist = camera.position.z / -ray.z;
            for (int step = 0; step < 8; ++step) {
                at = camera.position + dist * ray;
                dist += (at.z - 0.1 * std::sin(3 * at.x) * std::cos(2 * at.y)) / -ray.z * 0.8;
            }
            view.depth.at(x, y) = static_cast<float>(dist);
            const auto wave = [](double v) {
                return static_cast<std::uint8_t>(127.5 + 127 * std::sin(v));
            };
            view.texture.rgba8()->at(x, y) = {wave(5 * at.x), wave(7 * at.y), wave(at.x + at.y),
                                              255};
        }
    }
    return view;
}

struct Wall {
    Bundle bundle;
    std::vector<ViewSummary> summaries;

    Wall() {
        for (int i = 0; i < kViews; ++i) {
            bundle.views.push_back(viewOf(before(kBetween * i, 0.2 * std::sin(2.0 * i))));
            bundle.views.back().name = fmt::format("v{}", i);
        }
        summarise();
    }
    void summarise() {
        summaries.clear();
        for (const ReferenceView& view : bundle.views) summaries.push_back(summaryOfView(view));
    }
    [[nodiscard]] std::vector<bool> needed(const Camera& picture,
                                           const RenderSettings& settings = {}) const {
        return neededViews(Backend::cpu, -1, bundle.views, summaries, settings,
                           std::span(&picture, 1));
    }
    [[nodiscard]] std::ptrdiff_t count(const Camera& picture,
                                       const RenderSettings& settings = {}) const {
        return std::ranges::count(needed(picture, settings), true);
    }
};

const Wall& wall() {
    static const Wall kWall;
    return kWall;
}

TEST(NeededViews, AreThoseThatSeeWhatThePictureShows) {
    const auto needed = wall().needed(before(12.1));
    EXPECT_TRUE(needed[12]);
    EXPECT_TRUE(needed[13]);
    EXPECT_FALSE(needed[0]);
    EXPECT_FALSE(needed[kViews - 1]);
    EXPECT_LE(std::ranges::count(needed, true), kViews / 2);
    // Of a picture that sees none of them, one says what colours are.
    EXPECT_EQ(wall().count(before(12.1, 3.14159)), 1);
}

TEST(NeededViews, DrawWhatAllDo) {
    for (const int which : {0, 1, 2, 3}) {
        RenderSettings settings;
        settings.normals = which % 2 == 1;
        if (which >= 2) settings.mode = RenderMode::splat;
        settings.refine = RefineSettings::none();
        for (const double x : {0.3, 9.77, 22.9}) {
            const Camera camera = before(x, 0.3 * std::sin(x));
            const auto needed = wall().needed(camera, settings);
            EXPECT_LT(std::ranges::count(needed, true), kViews);
            const Bundle some = withSomeViews(wall().bundle, needed);
            Job job;
            auto ofAll = makeRenderer(Backend::cpu, wall().bundle, settings, -1, job);
            auto ofSome = makeRenderer(some, wall().summaries, nullptr, settings, job);
            ASSERT_TRUE(ofAll && ofSome);
            const auto a = (*ofAll)->render(camera), b = (*ofSome)->render(camera);
            ASSERT_TRUE(a && b);
            EXPECT_EQ(a->colour, b->colour);
            EXPECT_EQ(a->depth, b->depth);
            EXPECT_EQ(a->normal, b->normal);
            EXPECT_GT(a->colour.at(kSize / 2, kSize / 2).a, 0.99f);
        }
    }
}

TEST(NeededViews, AreAllWhereSummariesDoNotTell) {
    const Camera camera = before(12.1);
    const auto all = [&](auto&& change) {
        Wall changed = wall();
        change(changed.bundle.views[3]);
        changed.summarise();
        return changed.count(camera) == kViews;
    };
    EXPECT_FALSE(all([](ReferenceView&) {}));
    EXPECT_TRUE(all([](ReferenceView& v) { v.pruned = true; }));
    EXPECT_TRUE(all([](ReferenceView& v) { v.background = true; }));
    EXPECT_TRUE(all([](ReferenceView& v) { v.noDepth = NoDepth::unknown; }));
    EXPECT_TRUE(all([](ReferenceView& v) { v.refined.doubt = 0.01f; }));
    EXPECT_TRUE(all([](ReferenceView& v) { v.camera = wall().bundle.views[4].camera; }));
    EXPECT_TRUE(all([](ReferenceView& v) {
        for (glm::u8vec4& p : v.texture.rgba8()->pixels()) p.a = 128;
    }));
    RenderSettings splats;
    splats.mode = RenderMode::splat;
    EXPECT_LT(wall().count(camera, splats), kViews);
    splats.splat = SplatRule::paper;
    EXPECT_EQ(wall().count(camera, splats), kViews);
    const auto onGpu = neededViews(Backend::gpu, -1, wall().bundle.views, wall().summaries, {},
                                   std::span(&camera, 1));
    EXPECT_EQ(std::ranges::count(onGpu, true), kViews);
}

TEST(NeededViews, ThatSeePastEverythingSeeFar) {
    // A hole in the wall: what is behind it may be in any picture beyond.
    Wall holed = wall();
    holed.bundle.views[0].depth.at(5, 70) = kNoDepth;
    holed.bundle.views[0].texture.rgba8()->at(5, 30) = glm::u8vec4(0);
    holed.summarise();
    EXPECT_TRUE(std::isinf(holed.summaries[0].farthest[3 * ViewSummary::kCells]));
    EXPECT_FALSE(std::isinf(holed.summaries[0].farthest[7 * ViewSummary::kCells + 7]));
    const Camera far = [&] {
        Camera camera = before(-3, 0.0);
        camera.position.z = -4;  // behind the wall, beside it
        camera.orientation = glm::angleAxis(0.4, glm::dvec3(0, 1, 0));
        return camera;
    }();
    EXPECT_FALSE(wall().needed(far)[0] && std::ranges::count(wall().needed(far), true) > 1);
    EXPECT_TRUE(holed.needed(far)[0]);
}

TEST(ViewSummary, IsTextAndBack) {
    const ViewSummary summary = wall().summaries[5];
    const auto back = ViewSummary::from(summary.text());
    ASSERT_TRUE(back);
    EXPECT_EQ(*back, summary);
    EXPECT_EQ(summary.text().size(), ViewSummary().text().size());
    EXPECT_EQ(summary.points, kSize * kSize);
    EXPECT_EQ(summary.border, 1.0);
    EXPECT_FALSE(summary.open);
}

TEST(ViewSummary, ComesOfNoOtherText) {
    const std::string text = wall().summaries[5].text();
    const auto with = [&](std::size_t at, char c) {
        std::string other = text;
        other[at] = c;
        return ViewSummary::from(other).has_value();
    };
    EXPECT_FALSE(ViewSummary::from(""));
    EXPECT_FALSE(ViewSummary::from(text + "0"));
    EXPECT_FALSE(with(0, '2'));                // another version
    EXPECT_FALSE(with(text.size() - 1, 'g'));  // no digit
    EXPECT_FALSE(with(2, 'f'));                // fewer points than none
    EXPECT_FALSE(with(text.size() - 8, 'c'));  // a distance below 0
    EXPECT_TRUE(with(text.size() - 1, text.back() == '0' ? '1' : '0'));
}

}  // namespace
}  // namespace stx
