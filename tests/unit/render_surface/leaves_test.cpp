#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "lib/render/surface/prepare/draft.hpp"

namespace stx::surface {
namespace {

/// A surface that bends more and more to the right, with steps of about a leaf's tolerance and some
/// pixels that are near edges.
struct WavyView {
    Source source;
    Draft draft;

    WavyView(int width, int height) {
        const Camera camera =
            Camera::fromFieldOfView({0, 0, 0}, {1, 0, 0, 0}, {1.0, 1.0}, false, width, height);
        source.space = PixelSpace(camera, 0.0);
        source.width = width;
        source.height = height;
        source.blocksX = (width + kBlock - 1) / kBlock;
        source.blocksY = (height + kBlock - 1) / kBlock;
        source.blocks.resize(static_cast<std::size_t>(source.blocksX) * source.blocksY);
        draft = {Image<float>(width, height),
                 Image<std::uint8_t>(width, height),
                 Image<std::uint8_t>(width, height, 1),
                 {}};
        std::mt19937 random(8);
        for (int y = 0; y < height; ++y) {
            for (int x = 0; x < width; ++x) {
                const float u = static_cast<float>(x), v = static_cast<float>(y);
                draft.q.at(x, y) = 1.0f + 0.001f * u - 0.0005f * v + 1.5e-7f * u * u * u +
                                   (y > 40 ? 1e-6f * u * static_cast<float>(random() % 9) : 0.0f);
                const unsigned distance = random() % 300 == 0 ? 2 : 4;
                draft.info.at(x, y) =
                    static_cast<std::uint8_t>(Info::kLinkRight | Info::kLinkDown | distance << 4);
            }
        }
    }
};

/// The leaves of a square as their definition says it: the largest squares that lie on their
/// least-squares plane.
void leavesOf(const WavyView& view, int x0, int y0, int size, std::vector<Leaf>& leaves) {
    const Draft& d = view.draft;
    if (size < 2 || x0 >= view.source.width - 1 || y0 >= view.source.height - 1) return;
    bool fits = x0 + size < view.source.width && y0 + size < view.source.height;
    Leaf leaf{};
    if (fits) {
        const float anchor = d.q.at(x0, y0), half = 0.5f * static_cast<float>(size);
        const int n = size + 1;
        float sum = 0, sumX = 0, sumY = 0;
        for (int y = 0; y < n; ++y) {
            for (int x = 0; x < n; ++x) {
                fits = fits && d.edgeDistance(x0 + x, y0 + y) >= 3;
                const float above = d.q.at(x0 + x, y0 + y) - anchor;
                sum += above;
                sumX += above * (static_cast<float>(x) - half);
                sumY += above * (static_cast<float>(y) - half);
            }
        }
        const auto count = static_cast<float>(n * n);
        const float spread = count * static_cast<float>(n * n - 1) / 12.0f;
        leaf = {static_cast<std::uint16_t>(x0),
                static_cast<std::uint16_t>(y0),
                static_cast<std::uint16_t>(size),
                0,
                sumX / spread,
                sumY / spread};
        leaf.q0 = anchor + sum / count - half * (leaf.qx + leaf.qy);
        for (int y = 0; y < n; ++y)
            for (int x = 0; x < n; ++x)
                fits = fits && std::abs(leaf.q0 + leaf.qx * static_cast<float>(x) +
                                        leaf.qy * static_cast<float>(y) - d.q.at(x0 + x, y0 + y)) <=
                                   view.source.flat * anchor;
    }
    if (fits) {
        leaves.push_back(leaf);
        return;
    }
    const int h = size / 2;
    for (const auto& [dx, dy] : {std::pair{0, 0}, {h, 0}, {0, h}, {h, h}})
        leavesOf(view, x0 + dx, y0 + dy, h, leaves);
}

TEST(Leaves, AreTheLargestSquaresThatLieOnTheirPlane) {
    WavyView view(150, 75);
    findLeaves(view.source, view.draft);
    std::vector<Leaf> expected;
    for (int y = 0; y < 75; y += kBlock)
        for (int x = 0; x < 150; x += kBlock) leavesOf(view, x, y, kBlock, expected);
    ASSERT_EQ(view.source.leaves.size(), expected.size());
    int ofSize[kBlock + 1] = {};
    for (std::size_t i = 0; i < expected.size(); ++i) {
        const Leaf &found = view.source.leaves[i], &wanted = expected[i];
        EXPECT_EQ(found.x, wanted.x);
        EXPECT_EQ(found.y, wanted.y);
        EXPECT_EQ(found.size, wanted.size) << found.x << ", " << found.y;
        EXPECT_EQ(found.q0, wanted.q0);
        EXPECT_EQ(found.qx, wanted.qx);
        EXPECT_EQ(found.qy, wanted.qy);
        ++ofSize[wanted.size];
    }
    for (const int size : {2, 4, 8, 16}) EXPECT_GT(ofSize[size], 0) << size;
}

TEST(Leaves, ABlockHasTheRangeOfItsPointsAndThoseBesideIt) {
    WavyView view(40, 40);
    view.draft.q.at(3, 4) = 0.0f;
    view.draft.q.at(5, 6) = -1.0f;
    view.draft.q.at(16, 16) = 3.0f;
    view.draft.q.at(39, 39) = 0.25f;
    findLeaves(view.source, view.draft);
    const auto& blocks = view.source.blocks;
    EXPECT_EQ(blocks[0].qMax, 3.0f);
    EXPECT_GT(blocks[0].qMin, 0.9f);
    EXPECT_LT(blocks[2].qMax, 2.0f);
    EXPECT_EQ(blocks[8].qMin, 0.25f);
}

}  // namespace
}  // namespace stx::surface
