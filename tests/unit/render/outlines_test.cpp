#include "lib/render/outline/outlines.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "lib/base/parallel.hpp"
#include "lib/render/bench/analytic_scene.hpp"
#include "lib/render/outline/round_outlines.hpp"
#include "lib/render/splat/cpu/cpu_splat.hpp"

namespace stx {
namespace {

/// A ball of radius 1 as some views see it from around, with a point wherever a ray meets it.
Bundle ballFromAround(int views = 12) {
    Bundle bundle;
    for (int n = 0; n < views; ++n) {
        const double angle = n * (6.283185307179586 / views);
        ReferenceView view;
        view.camera = Camera::fromFieldOfView({6 * std::sin(angle), 0, 6 * std::cos(angle)},
                                              glm::angleAxis(angle, glm::dvec3(0, 1, 0)),
                                              {0.4, 0.4}, false, 128, 128);
        view.texture = Texture(Rgba8Image(128, 128));
        view.depth = Image<float>(128, 128, kNoDepth);
        const Camera& c = view.camera;
        for (int y = 0; y < 128; ++y) {
            for (int x = 0; x < 128; ++x) {
                // |p + t d| = 1, with d as long as makes t the distance along the axis.
                const glm::dvec3 d = c.orientation * c.unproject(x + 0.5, y + 0.5, 1.0);
                const double a = glm::dot(d, d), b = glm::dot(c.position, d);
                const double inside = b * b - a * (glm::dot(c.position, c.position) - 1);
                if (inside < 0) continue;
                view.depth.at(x, y) = static_cast<float>((-b - std::sqrt(inside)) / a);
                view.texture.rgba8()->at(x, y) = {255, 255, 255, 255};
            }
        }
        view.nearPlane = 4.9;
        view.farPlane = 7.1;
        bundle.views.push_back(std::move(view));
    }
    return bundle;
}

/// Between the views; the ball's outline is a circle around the middle of the picture.
Camera novelCamera(int size) {
    const double angle = 0.3;
    return Camera::fromFieldOfView({6 * std::sin(angle), 0, 6 * std::cos(angle)},
                                   glm::angleAxis(angle, glm::dvec3(0, 1, 0)), {0.4, 0.4}, false,
                                   size, size);
}

double outlineRadius(const Camera& camera) {
    return camera.fx / std::sqrt(6.0 * 6.0 - 1.0);
}

double fromCentre(const Camera& camera, double x, double y) {
    return std::hypot(x - camera.cx, y - camera.cy);
}

/// The ball drawn too large by 0.7 pixels.
Frame fatBall(const Camera& camera) {
    Frame frame;
    frame.colour = Image<glm::vec4>(camera.width, camera.height);
    frame.depth = Image<float>(camera.width, camera.height, kNoDepth);
    for (int y = 0; y < camera.height; ++y)
        for (int x = 0; x < camera.width; ++x)
            if (fromCentre(camera, x + 0.5, y + 0.5) < outlineRadius(camera) + 0.7)
                frame.depth.at(x, y) = 6.0f;
    return frame;
}

Image<float> allAsked(const Frame& frame) {
    const int w = frame.depth.width(), h = frame.depth.height();
    Image<float> covered(w, h, -1.0f);
    for (int y = 2; y + 2 < h; ++y) {
        for (int x = 2; x + 2 < w; ++x) {
            bool open = false;
            for (int j = -2; j <= 2; ++j)
                for (int i = -2; i <= 2; ++i)
                    open = open || !hasPoint(frame.depth.at(x + i, y + j));
            if (open && hasPoint(frame.depth.at(x, y))) covered.at(x, y) = Outlines::kAsked;
        }
    }
    return covered;
}

class OutlinesOf : public testing::TestWithParam<int> {};

/// Of more than sixteen views some are asked.
TEST_P(OutlinesOf, RunWhereTheOutermostPointsAre) {
    const Bundle bundle = ballFromAround(GetParam());
    const Camera camera = novelCamera(64);
    const Frame frame = fatBall(camera);
    Image<float> covered = allAsked(frame);
    const Image<float> before = covered;
    Outlines(bundle).measure(frame, camera, covered);
    double worst = 0, sum = 0;
    int count = 0, unknown = 0;
    for (int y = 0; y < 64; ++y) {
        for (int x = 0; x < 64; ++x) {
            if (before.at(x, y) != Outlines::kAsked) {
                EXPECT_EQ(covered.at(x, y), -1.0f) << "not asked for";
                continue;
            }
            if (covered.at(x, y) == Outlines::kAsked) {
                ++unknown;
                continue;
            }
            int inside = 0;
            for (int k = 0; k < 256; ++k)
                inside += fromCentre(camera, x + (k % 16 + 0.5) / 16, y + (k / 16 + 0.5) / 16) <
                          outlineRadius(camera);
            const double off = covered.at(x, y) - inside / 256.0;
            worst = std::max(worst, std::abs(off));
            sum += off;
            ++count;
        }
    }
    EXPECT_GT(count, 100);
    EXPECT_LT(unknown, count / 2) << "points are fewer towards the poles";
    EXPECT_LT(worst, 0.25);
    EXPECT_LT(std::abs(sum / count), 0.03);
}

INSTANTIATE_TEST_SUITE_P(Views, OutlinesOf, testing::Values(12, 40));

/// Points of glass have an alpha below one half, which says nothing of outlines.
TEST(Outlines, OfGlassRunWhereItsPointsAre) {
    Bundle bundle = ballFromAround();
    const Camera camera = novelCamera(64);
    const Frame frame = fatBall(camera);
    Image<float> opaque = allAsked(frame), glass = opaque, faint = opaque;
    Outlines(bundle).measure(frame, camera, opaque);
    for (ReferenceView& view : bundle.views)
        for (auto& p : view.texture.rgba8()->pixels()) p.a = p.a == 255 ? 77 : 0;
    const GlassPages pages(bundle);
    EXPECT_FALSE(pages.none());
    Outlines(bundle, &pages).measure(frame, camera, glass);
    EXPECT_TRUE(glass == opaque);
    const Image<float> asked = faint;
    Outlines(bundle).measure(frame, camera, faint);
    EXPECT_TRUE(faint == asked);
}

TEST(Outlines, AskNoViewThatLooksElsewhere) {
    Bundle bundle = ballFromAround();
    const Camera camera = novelCamera(64);
    const Frame frame = fatBall(camera);
    Image<float> alone = allAsked(frame), among = alone;
    Outlines(bundle).measure(frame, camera, alone);
    // As many and more in the same places, before the others.
    const std::vector<ReferenceView> views = bundle.views;
    for (const ReferenceView& view : views) {
        for (const double turn : {1.5, 3.0}) {
            ReferenceView other = view;
            other.camera.orientation *= glm::angleAxis(turn, glm::dvec3(0, 1, 0));
            other.depth = Image<float>(128, 128, kNoDepth);
            bundle.views.insert(bundle.views.begin(), other);
        }
    }
    Outlines(bundle).measure(frame, camera, among);
    EXPECT_EQ(among, alone);
}

TEST(Outlines, SayNothingWherePointsAreFew) {
    const Bundle bundle = ballFromAround();
    const Camera camera = novelCamera(512);
    const Frame frame = fatBall(camera);
    Image<float> covered = allAsked(frame);
    Bundle one;
    one.views.push_back(bundle.views[0]);
    const Image<float> before = covered;
    Outlines(one).measure(frame, camera, covered);
    EXPECT_EQ(covered, before);
}

TEST(Outlines, TheSameOnAnyNumberOfThreads) {
    const Bundle bundle = ballFromAround(20);
    const Camera camera = novelCamera(200);
    const Frame frame = fatBall(camera);
    Image<float> first;
    for (const int threads : {1, 3}) {
        const ThreadLimit limit(threads);
        Image<float> covered = allAsked(frame);
        Outlines(bundle).measure(frame, camera, covered);
        if (first.empty()) first = covered;
        EXPECT_EQ(first, covered);
    }
}

TEST(Outlines, OfAFrameKnowNothingOfTheFrameBefore) {
    const Bundle bundle = ballFromAround();
    Outlines outlines(bundle);
    for (const int size : {200, 64, 300, 200}) {
        const Camera camera = novelCamera(size);
        const Frame frame = fatBall(camera);
        Image<float> alone = allAsked(frame), covered = alone, part = alone;
        Outlines(bundle).measure(frame, camera, alone);
        outlines.measure(frame, camera, covered);
        EXPECT_EQ(covered, alone) << size;
        // All that is asked for lies here.
        const int reach = static_cast<int>(outlineRadius(camera)) + 2;
        const int from = size / 2 - reach, to = size / 2 + reach;
        outlines.measure(frame, camera, part, {from, from, to, to});
        EXPECT_EQ(part, alone) << "a part of " << size;
    }
}

/// The ball with its depth, and edge pixels that are covered by 0.9; `flat`: a disc that faces the
/// camera.
Frame ballWithSoftEdge(const Camera& camera, bool flat) {
    Frame frame = fatBall(camera);
    frame.depth = Image<float>(camera.width, camera.height, kNoDepth);
    const double edge = outlineRadius(camera);
    for (int y = 0; y < camera.height; ++y) {
        for (int x = 0; x < camera.width; ++x) {
            const double r = fromCentre(camera, x + 0.5, y + 0.5);
            if (r > edge + 0.7) continue;
            const double inside = std::max(0.0, 1 - r * r / (edge * edge));
            frame.depth.at(x, y) = static_cast<float>(flat ? 6 : 6 - std::sqrt(inside));
            frame.colour.at(x, y) = glm::vec4(r > edge - 0.7 ? 0.9f : 1.0f);
        }
    }
    return frame;
}

double coveredArea(const Frame& frame) {
    double sum = 0;
    for (const glm::vec4& c : frame.colour.pixels()) sum += c.w;
    return sum;
}

TEST(RoundOutlines, AreCutWhereASurfaceTurnsAway) {
    const Bundle bundle = ballFromAround();
    Outlines outlines(bundle);
    const Camera camera = novelCamera(64);
    const double area = 3.14159265358979 * outlineRadius(camera) * outlineRadius(camera);
    Frame ball = ballWithSoftEdge(camera, false);
    EXPECT_GT(coveredArea(ball), 1.025 * area);
    cutRoundOutlines(outlines, camera, ball);
    EXPECT_NEAR(coveredArea(ball) / area, 1.0, 0.015);
    for (std::size_t k = 0; k < ball.colour.count(); ++k) {
        const glm::vec4 c = ball.colour.pixels()[k];
        EXPECT_EQ(c.x, c.w) << "premultiplied";
        if (c.w == 0.0f) {
            EXPECT_FALSE(hasPoint(ball.depth.pixels()[k]));
        }
    }
}

TEST(RoundOutlines, OfSheetsStayAsTheyAre) {
    const Bundle bundle = ballFromAround();
    Outlines outlines(bundle);
    const Camera camera = novelCamera(64);
    Frame disc = ballWithSoftEdge(camera, true);
    const Image<glm::vec4> before = disc.colour;
    cutRoundOutlines(outlines, camera, disc);
    EXPECT_EQ(disc.colour, before);
}

/// Splats alone reach beyond the outline by 0.4 pixels.
TEST(Outlines, OfSplattedPicturesAreThoseOfTheObject) {
    const Bundle bundle = analyticBundle(AnalyticScene::object, 8, 2);
    const Camera camera = analyticCamera(AnalyticScene::object, 0.5, 8);
    Job job;
    const auto frame = makeCpuSplatRenderer(bundle, {}, job)->render(camera);
    ASSERT_TRUE(frame);
    const ReferenceView truth = viewOfAnalyticScene(AnalyticScene::object, camera, 8);
    double more = 0;
    int partial = 0;
    for (int y = 0; y < camera.height; ++y) {
        for (int x = 0; x < camera.width; ++x) {
            const float alpha = truth.texture.at(x, y).a;
            more += frame->colour.at(x, y).a - alpha;
            partial += alpha > 0 && alpha < 1;
        }
    }
    RecordProperty("pixels", fmt::format("{:.3f}", more / partial));
    EXPECT_LT(std::abs(more / partial), 0.1);
}

}  // namespace
}  // namespace stx
