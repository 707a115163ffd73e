#include "lib/render/outline/silhouettes.hpp"

#include <gtest/gtest.h>

#include "lib/base/parallel.hpp"
#include "lib/geometry/camera.hpp"

namespace stx {
namespace {

constexpr int kSize = 64;

/// A disc of radius 0.5 facing the camera, as one view sees it; coverage by 8x8 samples.
Bundle discBundle() {
    Bundle bundle;
    ReferenceView view;
    view.camera = Camera::fromFieldOfView({0, 0, 3}, {1, 0, 0, 0}, {0.5, 0.5}, false, kSize, kSize);
    Rgba8Image texture(kSize, kSize);
    view.depth = Image<float>(kSize, kSize, kNoDepth);
    for (int y = 0; y < kSize; ++y) {
        for (int x = 0; x < kSize; ++x) {
            int inside = 0;
            for (int k = 0; k < 64; ++k) {
                const auto p =
                    view.camera.unproject(x + (k % 8 + 0.5) / 8, y + (k / 8 + 0.5) / 8, 3.0);
                inside += glm::length(glm::dvec2(p)) < 0.5;
            }
            texture.at(x, y) = {200, 100, 50, static_cast<std::uint8_t>(inside * 255 / 64)};
            if (glm::length(glm::dvec2(view.camera.unproject(x + 0.5, y + 0.5, 3.0))) < 0.5)
                view.depth.at(x, y) = 3.0f;
        }
    }
    view.texture = Texture(std::move(texture));
    view.nearPlane = 2.9;
    view.farPlane = 3.1;
    bundle.views.push_back(std::move(view));
    return bundle;
}

/// The disc drawn too large, as splats do: whole pixels up to a pixel and a half outside.
Frame fatFrame(const Camera& camera) {
    Frame frame;
    frame.colour = Image<glm::vec4>(kSize, kSize, glm::vec4(0));
    frame.depth = Image<float>(kSize, kSize, kNoDepth);
    const double pixel = camera.sampleSpacing(3.0).x;
    for (int y = 0; y < kSize; ++y) {
        for (int x = 0; x < kSize; ++x) {
            if (glm::length(glm::dvec2(camera.unproject(x + 0.5, y + 0.5, 3.0))) >
                0.5 + 1.5 * pixel)
                continue;
            frame.colour.at(x, y) = {0.8f, 0.4f, 0.2f, 1.0f};
            frame.depth.at(x, y) = 3.0f;
        }
    }
    return frame;
}

TEST(Silhouettes, FatEdgesGetTheCoverageThatTheReferenceSaw) {
    const auto bundle = discBundle();
    const auto& camera = bundle.views[0].camera;
    auto frame = fatFrame(camera);
    Silhouettes(bundle).carve(frame, camera);
    double worst = 0;
    for (int y = 0; y < kSize; ++y) {
        for (int x = 0; x < kSize; ++x) {
            const float truth = bundle.views[0].texture.at(x, y).w;
            const auto c = frame.colour.at(x, y);
            worst = std::max<double>(worst, std::abs(c.w - truth));
            if (c.w > 0) {
                EXPECT_NEAR(c.x / c.w, 0.8f, 1e-5f) << "straight colour stays";
            }
            EXPECT_EQ(hasPoint(frame.depth.at(x, y)), c.w > 0.0f);
        }
    }
    EXPECT_LT(worst, 0.3) << "coverage is that of the disc to a fraction of a pixel";
    EXPECT_EQ(frame.colour.at(kSize / 2, kSize / 2).w, 1.0f);
}

TEST(Silhouettes, AreThoseOfWhatWasDrawn) {
    const auto bundle = discBundle();
    const auto& camera = bundle.views[0].camera;
    auto whole = fatFrame(camera);
    Extent drawn{kSize, kSize, 0, 0};
    for (int y = 0; y < kSize; ++y)
        for (int x = 0; x < kSize; ++x)
            if (hasPoint(whole.depth.at(x, y)))
                drawn = {std::min(drawn.x0, x), std::min(drawn.y0, y), std::max(drawn.x1, x + 1),
                         std::max(drawn.y1, y + 1)};
    auto part = whole, again = whole;
    Silhouettes silhouettes(bundle);
    silhouettes.carve(whole, camera);
    silhouettes.carve(part, camera, drawn);
    silhouettes.carve(again, camera);
    EXPECT_FALSE(whole.colour == fatFrame(camera).colour);
    EXPECT_TRUE(part.colour == whole.colour && part.depth == whole.depth);
    EXPECT_TRUE(again.colour == whole.colour && again.depth == whole.depth);
}

TEST(Silhouettes, FullScenesAreLeftAlone) {
    auto bundle = discBundle();
    for (auto& p : bundle.views[0].texture.rgba8()->pixels()) p.w = 255;
    Silhouettes silhouettes(bundle);
    EXPECT_TRUE(silhouettes.none());
    auto frame = fatFrame(bundle.views[0].camera);
    const auto before = frame.colour;
    silhouettes.carve(frame, bundle.views[0].camera);
    EXPECT_TRUE(before == frame.colour);
}

/// The disc from behind, where a pane of glass that fills the picture is before it.
ReferenceView paneBeforeTheDisc() {
    ReferenceView view;
    view.camera =
        Camera::fromFieldOfView({0, 0, -3}, {0, 0, 1, 0}, {0.5, 0.5}, false, kSize, kSize);
    view.texture = Texture(Rgba8Image(kSize, kSize, glm::u8vec4(90, 90, 90, 77)));
    view.depth = Image<float>(kSize, kSize, 1.0f);
    view.nearPlane = 0.9;
    view.farPlane = 1.1;
    return view;
}

/// The alpha of glass, 0.3, was taken for that of an outline that rays pass by.
TEST(Silhouettes, NoRayPassesByInsideOfGlass) {
    auto bundle = discBundle();
    const auto camera = bundle.views[0].camera;
    auto alone = fatFrame(camera), behindGlass = fatFrame(camera);
    Silhouettes(bundle).carve(alone, camera);
    bundle.views.push_back(paneBeforeTheDisc());
    ASSERT_GT(bundle.views[1].camera.forward().z, 0.99);
    Silhouettes(bundle).carve(behindGlass, camera);
    EXPECT_FALSE(alone.colour == fatFrame(camera).colour);
    EXPECT_TRUE(behindGlass.colour == alone.colour && behindGlass.depth == alone.depth);
}

/// A rim of glass was given its coverage as alpha: opaque, and bright.
TEST(Silhouettes, GlassKeepsItsAlphaAtItsOutline) {
    for (const int percent : {30, 60}) {
        const float own = static_cast<float>(percent) / 100.0f;
        auto bundle = discBundle();
        const auto& camera = bundle.views[0].camera;
        double truth = 0;
        for (auto& p : bundle.views[0].texture.rgba8()->pixels()) {
            truth += own * p.w / 255.0;
            p.w = static_cast<std::uint8_t>(p.w * percent / 100);
        }
        auto frame = fatFrame(camera);
        for (auto& c : frame.colour.pixels()) c *= own;
        Silhouettes(bundle).carve(frame, camera);
        double sum = 0;
        float most = 0;
        for (const auto& c : frame.colour.pixels()) {
            sum += c.w;
            most = std::max(most, c.w);
            if (c.w > 0) {
                EXPECT_NEAR(c.x / c.w, 0.8f, 1e-4f) << "straight colour stays";
            }
        }
        EXPECT_NEAR(most, own, 1e-5f) << percent;
        EXPECT_NEAR(sum / truth, 1.0, 0.05) << percent;
    }
}

TEST(Silhouettes, TheSameOnAnyNumberOfThreads) {
    const auto bundle = discBundle();
    Image<glm::vec4> first;
    for (const int threads : {1, 3}) {
        const ThreadLimit limit(threads);
        auto frame = fatFrame(bundle.views[0].camera);
        Silhouettes(bundle).carve(frame, bundle.views[0].camera);
        if (first.empty()) first = frame.colour;
        EXPECT_TRUE(first == frame.colour);
    }
}

}  // namespace
}  // namespace stx
