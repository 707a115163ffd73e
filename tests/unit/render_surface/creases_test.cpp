#include <cmath>
#include <functional>
#include <optional>

#include <gtest/gtest.h>

#include "lib/render/surface/prepare/source.hpp"

namespace stx::surface {
namespace {

constexpr int kRidgeSide = 40;
constexpr double kPixel = 0.02;  // scene units

/// A view along parallel rays of what lies `distAt` (x, y) away, pixels to pixels' sizes.
Bundle viewOf(const std::function<std::optional<double>(double, double)>& distAt, int bits = 32) {
    ReferenceView view;
    view.camera = Camera::fromFieldOfView({0, 0, 0}, {1, 0, 0, 0}, glm::dvec2(kRidgeSide * kPixel),
                                          true, kRidgeSide, kRidgeSide);
    view.nearPlane = 1;
    view.farPlane = 9;
    view.depthBits = bits;
    view.depth = Image<float>(kRidgeSide, kRidgeSide, kNoDepth);
    Rgba8Image texture(kRidgeSide, kRidgeSide, glm::u8vec4(0));
    for (int y = 0; y < kRidgeSide; ++y)
        for (int x = 0; x < kRidgeSide; ++x) {
            const auto dist = distAt(x + 0.5, y + 0.5);
            if (!dist) continue;
            const double step = bits < 32 ? view.depthCode().step() : 0;
            const double kept =
                step > 0 ? std::round(*dist * kPixel / step) * step : *dist * kPixel;
            view.depth.at(x, y) = static_cast<float>(kept);
            texture.at(x, y) = glm::u8vec4(99, 99, 99, 255);
        }
    view.texture = Texture(std::move(texture));
    Bundle bundle;
    bundle.views = {view};
    return bundle;
}

std::vector<glm::ivec2> creasesIn(const Bundle& bundle) {
    const SurfaceScene scene(bundle);
    std::vector<glm::ivec2> found;
    for (int y = 0; y < kRidgeSide; ++y)
        for (int x = 0; x < kRidgeSide; ++x)
            if (scene.pages[0].info.at(x, y) & Info::kCrease) found.emplace_back(x, y);
    return found;
}

TEST(Creases, RunThroughThePixelsOfBothFaces) {
    // Two faces that meet in a ridge, upright and slanted.
    for (const double slant : {0.0, 0.3}) {
        const auto edge = [&](double y) { return 17.5 + slant * (y - 0.5 * kRidgeSide); };
        const Bundle ridge =
            viewOf([&](double x, double y) { return 200 + 1.4 * std::abs(x - edge(y)); });
        const auto found = creasesIn(ridge);
        EXPECT_GT(found.size(), kRidgeSide / 3);
        for (const glm::ivec2 at : found)
            EXPECT_LT(std::abs(at.x + 0.5 - edge(at.y + 0.5)), 1.0) << at.x << ' ' << at.y;
    }
}

// Both pixels bend, each by less than the whole turn.
TEST(Creases, RunBetweenTheMiddlesOfPixels) {
    for (const double edge : {17.5, 17.7, 17.9, 18.2}) {
        const auto found =
            creasesIn(viewOf([&](double x, double) { return 200 + 0.75 * std::abs(x - edge); }));
        EXPECT_GE(found.size(), kRidgeSide) << edge;
        for (const glm::ivec2 at : found)
            EXPECT_LE(std::abs(at.x + 0.5 - edge), 0.5) << edge << ": " << at.x << ' ' << at.y;
    }
}

TEST(Creases, AreNotWhereSurfacesTurnAwayOrJump) {
    const Bundle ball = viewOf([](double x, double y) -> std::optional<double> {
        const double left = 15 * 15 - std::pow(x - 20.2, 2) - std::pow(y - 19.9, 2);
        if (left < 0) return {};
        return 220 - std::sqrt(left);
    });
    EXPECT_TRUE(creasesIn(ball).empty());
    EXPECT_TRUE(creasesIn(viewOf([](double x, double) { return x < 20 ? 200 : 260; })).empty());
}

TEST(Creases, AreNotTheStepsOfADepthCode) {
    EXPECT_TRUE(
        creasesIn(viewOf([](double x, double y) { return 200 + 0.21 * x + 0.1 * y; }, 8)).empty());
}

}  // namespace
}  // namespace stx::surface
