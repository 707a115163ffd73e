#include "lib/render/surface/plan/plan.hpp"

#include <algorithm>

#include <gtest/gtest.h>

#include "lib/render/bench/analytic_scene.hpp"
#include "lib/render/surface/cpu/raster.hpp"
#include "lib/render/surface/plan/placement.hpp"

namespace stx::surface {
namespace {

class PlannedBlocks : public testing::TestWithParam<AnalyticScene> {};

/// A block that is not in the list of a tile must have nothing to draw there.
TEST_P(PlannedBlocks, AreAllThatShowInATile) {
    const Bundle bundle = analyticBundle(GetParam(), 4);
    const SurfaceScene scene(bundle);
    Effort effort;
    effort.samplesPerPixel = 2;
    const Camera camera = analyticCamera(GetParam(), 0.4, 4);
    const SurfaceFrame frame = planFrame(scene, boundsOf(scene), effort, camera);
    const SampleGrid grid{effort.samplesPerPixel};
    std::vector<float> listed(grid.count()), all(grid.count());
    std::size_t blocks = 0, drawn = 0;
    for (const FrameSource& f : frame.sources) {
        std::vector<std::uint32_t> every;
        for (std::uint32_t i = 0; i < f.source->blocks.size(); ++i)
            if (f.source->blocks[i].qMax > 0) every.push_back(i);
        blocks += every.size();
        drawn += f.blocks.size();
        for (int tile = 0; tile < frame.tiles.count(); tile += 7) {
            const Warp warp =
                warpFrom(frame.sampleFromPixel(tile, effort.samplesPerPixel) * f.pixelFromSource);
            const auto draw = [&](std::span<const std::uint32_t> some,
                                  std::vector<float>& samples) {
                if (!rasteriseSource(*f.source, warp, some, grid, frame.space.axis, samples.data()))
                    std::fill(samples.begin(), samples.end(), 0.0f);
            };
            draw(f.blocksOf(tile), listed);
            draw(every, all);
            ASSERT_EQ(listed, all) << "source " << f.source->number << ", tile " << tile;
        }
    }
    // 2.4 for flat blocks as large in the frame as in their view; those of the object have depth.
    EXPECT_LT(static_cast<double>(drawn), 4.7 * static_cast<double>(blocks));
}

/// Other tiles would choose other sources, and move outlines by a part of a pixel.
TEST(PlannedTiles, OfAPartOfAFrameAreThoseOfTheWhole) {
    const Bundle bundle = analyticBundle(AnalyticScene::object, 9);
    const SurfaceScene scene(bundle);
    const Camera camera = analyticCamera(AnalyticScene::object, 0.4, 9).resized(351, 283);
    const SurfaceFrame whole = planFrame(scene, boundsOf(scene), Effort{}, camera);
    for (const glm::ivec2 left : {glm::ivec2(13, 37), glm::ivec2(37, 13), glm::ivec2(200, 150)}) {
        Camera part = camera;
        part.width -= left.x;
        part.height -= left.y;
        part.cx -= left.x;
        part.cy -= left.y;
        const SurfaceFrame frame = planFrame(scene, boundsOf(scene), Effort{}, part);
        for (int tile = 0; tile < frame.tiles.count(); ++tile) {
            const glm::ivec2 first(frame.tiles.x(tile), frame.tiles.y(tile));
            const int same = whole.tiles.at(first + left);
            ASSERT_EQ(glm::ivec2(whole.tiles.x(same), whole.tiles.y(same)), first + left);
            std::vector<int> sources, ofWhole;
            for (const int k : frame.sourcesOf(tile))
                sources.push_back(frame.sources[static_cast<std::size_t>(k)].source->number);
            for (const int k : whole.sourcesOf(same))
                ofWhole.push_back(whole.sources[static_cast<std::size_t>(k)].source->number);
            EXPECT_EQ(sources, ofWhole) << "tile " << tile << " without the first " << left.x;
        }
    }
}

/// What is said to be seen from behind must have nothing to draw in any tile.
TEST(TurnedAwayBlocks, DrawNothing) {
    Bundle bundle;
    for (int i = 0; i < 4; ++i)
        bundle.views.push_back(viewOfAnalyticScene(
            AnalyticScene::object, analyticCamera(AnalyticScene::object, i, 4).resized(768, 768)));
    const SurfaceScene scene(bundle);
    for (const bool orthographic : {false, true}) {
        std::size_t away = 0, blocks = 0;
        for (const double angle : {0.4, 1.5, 3.0, 4.5}) {
            Camera camera = analyticCamera(AnalyticScene::object, angle, 4);
            if (orthographic) {
                const double size = 2.2 * boundsOf(scene).radius() / camera.width;
                camera.orthographic = true;
                camera.fx = camera.fy = 1.0 / size;
            }
            const SurfaceFrame frame = planFrame(scene, boundsOf(scene), Effort{}, camera);
            const SampleGrid grid{2};
            std::vector<float> samples(grid.count());
            for (const FrameSource& f : frame.sources) {
                for (int tile = 0; tile < frame.tiles.count(); tile += 3) {
                    std::vector<std::uint32_t> behind;
                    for (const std::uint32_t block : f.blocksOf(tile))
                        if (f.turnedAway[block]) behind.push_back(block);
                    away += behind.size();
                    blocks += f.blocksOf(tile).size();
                    const Warp warp = warpFrom(frame.sampleFromPixel(tile, 2) * f.pixelFromSource);
                    ASSERT_FALSE(rasteriseSource(*f.source, warp, behind, grid, frame.space.axis,
                                                 samples.data()))
                        << "source " << f.source->number << ", tile " << tile;
                }
            }
        }
        EXPECT_GT(away, blocks / 20) << (orthographic ? "orthographic" : "perspective");
    }
}

/// Where any view has a block, the tile is built from some; views that no tile is built from are
/// not placed, the others in full.
TEST_P(PlannedBlocks, AreChosenFromFewViews) {
    const Bundle bundle = analyticBundle(GetParam(), 6);
    const SurfaceScene scene(bundle);
    Effort effort;
    effort.mostGeometry = 2;
    std::size_t placed = 0;
    for (const double angle : {0.4, 2.0}) {
        Camera camera = analyticCamera(GetParam(), angle, 6);
        // A side of what the views show, close.
        camera.fx *= 8;
        camera.fy *= 8;
        camera.cx = -2.0 * camera.width;
        const SurfaceFrame frame = planFrame(scene, boundsOf(scene), effort, camera);
        const int tiles = frame.tiles.count();
        std::vector<char> used(frame.sources.size(), 0);
        for (int tile = 0; tile < tiles; ++tile)
            for (const int k : frame.sourcesOf(tile)) used[static_cast<std::size_t>(k)] = 1;
        for (std::size_t k = 0; k < used.size(); ++k) {
            FrameSource whole = frame.sources[k];
            placeBlocks(whole, frame.space, frame.tiles);
            for (int tile = 0; tile < tiles; ++tile) {
                const auto own = frame.sources[k].blocksOf(tile), all = whole.blocksOf(tile);
                const bool same = std::equal(own.begin(), own.end(), all.begin(), all.end());
                ASSERT_TRUE(used[k] ? same : own.empty()) << "source " << k << ", tile " << tile;
                ASSERT_TRUE(all.empty() || !frame.sourcesOf(tile).empty())
                    << "source " << k << ", tile " << tile;
            }
        }
        placed += static_cast<std::size_t>(std::count(used.begin(), used.end(), 1));
    }
    EXPECT_LT(placed, 2 * scene.sources.size());
}

/// Tiles are built from the same views, in the same order, however the views are ordered.
TEST_P(PlannedBlocks, DoNotHangOnTheOrderOfViews) {
    Bundle bundle = analyticBundle(GetParam(), 12);
    Effort effort;
    effort.mostGeometry = 2;
    const Camera camera = analyticCamera(GetParam(), 0.4, 12);
    const auto camerasOfTiles = [&] {
        const SurfaceScene scene(bundle);
        const SurfaceFrame frame = planFrame(scene, boundsOf(scene), effort, camera);
        std::vector<std::vector<glm::dvec3>> places;
        for (const std::vector<int>& tile : frame.tileSources) {
            places.emplace_back();
            for (const int k : tile)
                places.back().push_back(
                    frame.sources[static_cast<std::size_t>(k)].source->view->camera.position);
        }
        return places;
    };
    const auto before = camerasOfTiles();
    std::ranges::reverse(bundle.views);
    std::ranges::rotate(bundle.views, bundle.views.begin() + 5);
    EXPECT_EQ(camerasOfTiles(), before);
}

/// What is nearest of all views is nearest of those that a tile is built from.
TEST_P(PlannedBlocks, AreOfViewsThatShowAllThatAnyShows) {
    const Bundle bundle = analyticBundle(GetParam(), 8);
    const SurfaceScene scene(bundle);
    Effort effort;
    effort.mostGeometry = 1;
    const SampleGrid grid{1};
    std::vector<float> samples(grid.count()), chosen(grid.count()), all(grid.count());
    std::int64_t there = 0, lost = 0, sources = 0, tiles = 0;
    for (const double angle : {0.4, 2.5}) {
        const Camera camera = analyticCamera(GetParam(), angle, 8);
        const SurfaceFrame frame = planFrame(scene, boundsOf(scene), effort, camera);
        std::vector<FrameSource> placed = frame.sources;
        for (FrameSource& f : placed) placeBlocks(f, frame.space, frame.tiles);
        for (int tile = 0; tile < frame.tiles.count(); tile += 3) {
            std::fill(chosen.begin(), chosen.end(), 0.0f);
            std::fill(all.begin(), all.end(), 0.0f);
            const std::vector<int>& some = frame.sourcesOf(tile);
            tiles += !some.empty();
            sources += static_cast<std::int64_t>(some.size());
            for (std::size_t k = 0; k < placed.size(); ++k) {
                const FrameSource& f = placed[k];
                std::vector<std::uint32_t> facing;
                for (const std::uint32_t block : f.blocksOf(tile))
                    if (!f.turnedAway[block]) facing.push_back(block);
                const Warp warp = warpFrom(frame.sampleFromPixel(tile, 1) * f.pixelFromSource);
                if (!rasteriseSource(*f.source, warp, facing, grid, frame.space.axis,
                                     samples.data()))
                    continue;
                const bool isChosen =
                    std::find(some.begin(), some.end(), static_cast<int>(k)) != some.end();
                for (std::size_t i = 0; i < samples.size(); ++i) {
                    all[i] = std::max(all[i], samples[i]);
                    if (isChosen) chosen[i] = std::max(chosen[i], samples[i]);
                }
            }
            for (std::size_t i = 0; i < all.size(); ++i) {
                there += all[i] > 0;
                lost += chosen[i] < 0.97f * all[i];
            }
        }
    }
    EXPECT_GT(there, 5000);
    EXPECT_LT(static_cast<double>(lost), 0.005 * static_cast<double>(there));
    EXPECT_LT(sources, 6 * tiles);
}

/// A camera amid the object: blocks on both sides of its plane.
TEST(PlannedTiles, AreChosenWhereBlocksAreBehindTheCamera) {
    const Bundle bundle = analyticBundle(AnalyticScene::object, 8);
    const SurfaceScene scene(bundle);
    Effort effort;
    effort.mostGeometry = 3;
    Camera camera = analyticCamera(AnalyticScene::object, 0.4, 8);
    camera.position = boundsOf(scene).centre() + 0.4 * boundsOf(scene).radius() * camera.forward();
    const SurfaceFrame frame = planFrame(scene, boundsOf(scene), effort, camera);
    int filled = 0;
    for (const FrameSource& f : frame.sources) {
        FrameSource whole = f;
        placeBlocks(whole, frame.space, frame.tiles);
        for (int tile = 0; tile < frame.tiles.count(); ++tile) {
            if (whole.blocksOf(tile).empty()) continue;
            ++filled;
            EXPECT_FALSE(frame.sourcesOf(tile).empty()) << "tile " << tile;
        }
    }
    EXPECT_GT(filled, 0);
}

/// Sums of shares that are all 1 are rounded.
TEST(PlannedEffort, TakesNoMoreSourcesForRounding) {
    for (const int views : {3, 6, 10, 49}) {
        Bundle bundle;
        for (int i = 0; i < views; ++i)
            bundle.views.push_back(
                viewOfAnalyticScene(AnalyticScene::room,
                                    analyticCamera(AnalyticScene::room, i, views).resized(32, 24)));
        EXPECT_EQ(effortOf({}, SurfaceScene(bundle)).mostGeometry, 8) << views;
    }
}

INSTANTIATE_TEST_SUITE_P(Scenes, PlannedBlocks,
                         testing::Values(AnalyticScene::object, AnalyticScene::room));

}  // namespace
}  // namespace stx::surface
