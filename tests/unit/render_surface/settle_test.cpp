// Pixels that one sample in their middle settles, against all samples of them.
#include "lib/render/surface/cpu/settle.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "lib/render/bench/analytic_scene.hpp"
#include "lib/render/surface/cpu/fuse.hpp"
#include "lib/render/surface/plan/plan.hpp"

namespace stx::surface {
namespace settle_test {

constexpr int kPerPixel = 3;
const SampleGrid kAll{kPerPixel};

/// A tile of a frame, drawn with samples of a grid.
struct DrawnTile {
    const SurfaceFrame& frame;
    int tile;
    std::vector<std::vector<float>> samples;
    std::vector<LocalSource> sources;
    std::vector<std::vector<DrawnBox>> drawnIn;

    DrawnTile(const SurfaceFrame& f, int number, const SampleGrid& grid, RasterNeeds needs = {},
              const DrawnTile* middles = nullptr)
        : frame(f), tile(number) {
        for (std::size_t k = 0; k < f.sources.size(); ++k) {
            const FrameSource& s = f.sources[k];
            std::vector<std::uint32_t> blocks;
            for (std::size_t i = 0; i < s.blocksOf(tile).size(); ++i)
                if (!middles || middles->drawnIn[k][i].squaresOf(1, 1) & needs.squares)
                    blocks.push_back(s.blocksOf(tile)[i]);
            samples.emplace_back(grid.count(), -1.0f);
            drawnIn.emplace_back(blocks.size());
            if (grid.apron > 0) needs.drawnIn = drawnIn.back();
            const glm::dmat4 map =
                f.sampleFromPixel(tile, grid.perPixel, grid.apron) * s.pixelFromSource;
            const bool drawn = rasteriseSource(*s.source, warpFrom(map), blocks, grid, f.space.axis,
                                               samples.back().data(), needs);
            sources.push_back({s.source, s.sourceFromPixel, nullptr});
            if (drawn) sources.back().samples = samples.back().data();
        }
    }
    [[nodiscard]] TilePixels pixels() const {
        const Camera& camera = frame.space.camera;
        return pixelsInFrame(frame.tiles.x(tile), frame.tiles.y(tile), camera.width, camera.height);
    }
};

class SettledPixels : public testing::TestWithParam<AnalyticScene> {
  protected:
    Bundle bundle = analyticBundle(GetParam(), 4);
    SurfaceScene scene{bundle};
    SurfaceFrame frame =
        planFrame(scene, boundsOf(scene), Effort(), analyticCamera(GetParam(), 0.4, 4));
};

TEST_P(SettledPixels, ShowWhatAllTheirSamplesShow) {
    int settled = 0, all = 0, differing = 0, partial = 0, partialSettled = 0;
    for (int tile = 0; tile < frame.tiles.count(); tile += 3) {
        const DrawnTile middles(frame, tile, kMiddles, {kAllSquares, true, {}});
        const DrawnTile fine(frame, tile, kAll);
        const int x = frame.tiles.x(tile), y = frame.tiles.y(tile);
        Pieces few, many;
        const TilePixels open = fuseSettled(middles.sources, kMiddles, frame.space.axis, x, y,
                                            fine.pixels(), kPerPixel, few);
        fuseTile(fine.sources, kAll, frame.space.axis, x, y, fine.pixels(), many);
        struct Shown {
            int pieces = 0;
            float share = 0, q = 0, qx = 0, qy = 0;
            std::uint32_t sources = 0;
        };
        const auto shownOf = [](const Pieces& pieces) {
            std::vector<Shown> shown(static_cast<std::size_t>(kTile) * kTile);
            for (std::size_t i = 0; i < pieces.size(); ++i) {
                Shown& s = shown[pieces.pixel[i]];
                ++s.pieces;
                s.share += pieces.share[i];
                s.q = pieces.q[i];
                s.qx = pieces.qx[i];
                s.qy = pieces.qy[i];
                s.sources |= pieces.sources[i];
            }
            return shown;
        };
        const auto one = shownOf(few), expected = shownOf(many);
        for (int row = 0; row < kTile; ++row) {
            for (int column = 0; column < kTile; ++column) {
                if (!(fine.pixels()[static_cast<std::size_t>(row)] >> column & 1)) continue;
                const auto at = static_cast<std::size_t>(row * kTile + column);
                const Shown &a = one[at], &b = expected[at];
                const bool isOpen = open[static_cast<std::size_t>(row)] >> column & 1;
                const bool isPartial = b.share > 0 && b.share < 0.99f;
                all += b.pieces > 0;
                partial += isPartial;
                if (isOpen) {
                    EXPECT_EQ(a.pieces, 0);
                    continue;
                }
                settled += a.pieces > 0;
                partialSettled += isPartial;
                const bool same =
                    a.pieces == b.pieces &&
                    (a.pieces == 0 ||
                     (std::abs(a.q - b.q) < 1e-3f * b.q && std::abs(a.qx - b.qx) < 3e-3f * b.q &&
                      std::abs(a.qy - b.qy) < 3e-3f * b.q && (a.sources & b.sources) != 0));
                differing += !same;
            }
        }
    }
    // The object's four views share little of its surface; the room is seen by all.
    const bool object = GetParam() == AnalyticScene::object;
    EXPECT_GT(all, 2000);
    EXPECT_GT(settled, object ? all / 8 : all / 2);
    EXPECT_LE(differing, settled / 500) << "of " << settled;
    // Edges of the picture are never settled.
    EXPECT_GT(partial, object ? 100 : 5);
    EXPECT_LE(partialSettled, partial / 100);
}

TEST_P(SettledPixels, SquaresThatAreAskedForAreDrawnAsTheWholeTileIs) {
    const Squares asked = 0x00'18'3c'00'81'00'ff'01u;
    int compared = 0, differing = 0;
    for (int tile = 0; tile < frame.tiles.count(); tile += 5) {
        const DrawnTile middles(frame, tile, kMiddles, {kAllSquares, true, {}});
        const DrawnTile whole(frame, tile, kAll);
        const DrawnTile some(frame, tile, kAll, {asked, false, {}}, &middles);
        for (std::size_t k = 0; k < whole.sources.size(); ++k) {
            if (!whole.sources[k].samples) continue;
            for (int y = 0; y < kAll.side(); ++y) {
                for (int x = 0; x < kAll.side(); ++x) {
                    const int square = y / (kSquare * kPerPixel) * 8 + x / (kSquare * kPerPixel);
                    if (!(asked >> square & 1)) continue;
                    const auto at = static_cast<std::size_t>(y * kAll.stride() + x);
                    const float drawn = some.sources[k].samples ? some.samples[k][at] : 0.0f;
                    ++compared;
                    differing += drawn != whole.samples[k][at];
                }
            }
        }
    }
    EXPECT_GT(compared, 20000);
    // Blocks that no middle of a pixel meets may be left out.
    EXPECT_LE(differing, compared / 2000);
}

INSTANTIATE_TEST_SUITE_P(Scenes, SettledPixels,
                         testing::Values(AnalyticScene::object, AnalyticScene::room));

}  // namespace settle_test
}  // namespace stx::surface
