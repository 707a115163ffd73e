// What a summary says of a view, and a quick look that finds summaries of other pixels.
#include "lib/render/surface/prepare/summary.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "lib/render/surface/prepare/source.hpp"

namespace stx::surface {
namespace {

constexpr int kSlopeWidth = 150, kSlopeHeight = 90;  // no multiples of blocks or cells

/// A slope before a camera, in waves. `edge`: the object ends there, pixels from the left.
ReferenceView slope(int edge = kSlopeWidth) {
    ReferenceView view;
    view.camera.width = kSlopeWidth;
    view.camera.height = kSlopeHeight;
    view.camera.position = {5, -3, 2};
    view.camera.orientation = glm::angleAxis(0.7, glm::normalize(glm::dvec3(1, 2, 0.5)));
    view.camera.fx = view.camera.fy = 120;
    view.camera.cx = kSlopeWidth / 2.0;
    view.camera.cy = kSlopeHeight / 2.0;
    view.depthBits = 32;
    view.nearPlane = 1;
    view.farPlane = 9;
    view.texture = Rgba8Image(kSlopeWidth, kSlopeHeight, glm::u8vec4(90, 120, 60, 255));
    view.depth = Image<float>(kSlopeWidth, kSlopeHeight);
    for (int y = 0; y < kSlopeHeight; ++y) {
        for (int x = 0; x < kSlopeWidth; ++x) {
            view.depth.at(x, y) = 3.0f + 0.03f * x + 0.02f * y + 0.2f * std::sin(0.2f * (x + y));
            if (x < edge) continue;
            view.depth.at(x, y) = kNoDepth;
            view.texture.rgba8()->at(x, y).a = 0;
        }
    }
    return view;
}

/// As ViewSummary::farthest is defined, block by block and pixel by pixel.
std::array<float, ViewSummary::kCells * ViewSummary::kCells> farthestOf(const ReferenceView& view) {
    constexpr float kFar = std::numeric_limits<float>::infinity();
    constexpr int kCells = ViewSummary::kCells, kAround = 4;
    Bundle bundle;
    bundle.views.push_back(view);
    RenderSettings settings;
    settings.without.add(Stage::creases);
    const SurfaceScene scene(bundle, settings);
    const Source& s = scene.sources.front();
    std::array<float, kCells * kCells> out{};
    for (int by = 0; by < s.blocksY; ++by) {
        for (int bx = 0; bx < s.blocksX; ++bx) {
            const BlockRange& block = s.blocks[static_cast<std::size_t>(by * s.blocksX + bx)];
            float least = block.qMin - block.reach;
            bool missing = false;
            for (int y = by * kBlock - kAround; y < (by + 1) * kBlock + kAround; ++y) {
                for (int x = bx * kBlock - kAround; x < (bx + 1) * kBlock + kAround; ++x) {
                    if (!s.contains(x, y)) continue;
                    missing = missing || !(s.q(x, y) > 0) || s.alpha(x, y) < 1;
                    if (missing) continue;
                    const glm::vec2 g = s.gradient(x, y);
                    least = std::min(least, s.q(x, y) - 2 * (std::abs(g.x) + std::abs(g.y)));
                }
            }
            const float farthest = missing || !(least > 0) ? kFar : 1.0f / (least * (1 - 0.1f));
            for (int y = 0; y < kBlock; ++y) {
                for (int x = 0; x < kBlock; ++x) {
                    const int px = std::min(bx * kBlock + x, kSlopeWidth - 1);
                    const int py = std::min(by * kBlock + y, kSlopeHeight - 1);
                    float& most = out[static_cast<std::size_t>(py * kCells / kSlopeHeight * kCells +
                                                               px * kCells / kSlopeWidth)];
                    most = std::max(most, farthest);
                }
            }
        }
    }
    return out;
}

TEST(Summary, SaysOfEachCellHowFarItReaches) {
    for (const int edge : {kSlopeWidth, 101, 0})
        EXPECT_EQ(summaryOf(slope(edge)).farthest, farthestOf(slope(edge))) << edge;
    // What is missing, or near an edge, counts for blocks up to four pixels away.
    std::mt19937 random(7);
    for (int round = 0; round < 40; ++round) {
        ReferenceView view = slope();
        const int x = static_cast<int>(random() % kSlopeWidth);
        const int y = static_cast<int>(random() % kSlopeHeight);
        view.depth.at(x, y) = round % 2 ? kNoDepth : 8.5f;
        EXPECT_EQ(summaryOf(view).farthest, farthestOf(view)) << x << " " << y;
    }
}

TEST(Summary, MayBeThatOfItsOwnView) {
    for (const int edge : {kSlopeWidth, 101, 1, 0}) {
        ReferenceView view = slope(edge);
        EXPECT_TRUE(surface::mayBeSummaryOf(summaryOf(view), view)) << edge;
        view.camera.orthographic = true;
        EXPECT_TRUE(surface::mayBeSummaryOf(summaryOf(view), view)) << edge;
    }
}

TEST(Summary, IsNotThatOfOtherPixels) {
    const ReferenceView view = slope(), cut = slope(101);
    const auto isFound = [](const ReferenceView& of, auto&& change) {
        ViewSummary summary = summaryOf(of);
        change(summary);
        return !surface::mayBeSummaryOf(summary, of);
    };
    EXPECT_FALSE(isFound(view, [](ViewSummary&) {}));
    EXPECT_TRUE(isFound(view, [](ViewSummary& s) { ++s.points; }));
    EXPECT_TRUE(isFound(view, [](ViewSummary& s) { s.open = true; }));
    EXPECT_TRUE(isFound(cut, [](ViewSummary& s) { s.open = false; }));
    EXPECT_TRUE(isFound(view, [](ViewSummary& s) { s.bounds = {}; }));
    for (int k = 0; k < 3; ++k) {
        const auto narrow = [k](ViewSummary& s) { s.bounds.max[k] = s.bounds.min[k] + 0.5; };
        EXPECT_TRUE(isFound(view, narrow)) << k;
    }
    for (const std::size_t cell : {0u, 9u, 37u, 63u}) {
        EXPECT_TRUE(isFound(view, [&](ViewSummary& s) { s.farthest[cell] *= 0.6f; })) << cell;
        // Cells of the right half reach beyond the object's edge.
        if (cell % 8 >= 5) {
            EXPECT_TRUE(isFound(cut, [&](ViewSummary& s) { s.farthest[cell] = 100; })) << cell;
        }
    }
}

}  // namespace
}  // namespace stx::surface
