#include "lib/render/surface/plan.hpp"

#include <gtest/gtest.h>

#include "lib/render/bench/analytic_scene.hpp"
#include "lib/render/surface/cpu/raster.hpp"

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
        for (int tile = 0; tile < frame.tilesX * frame.tilesY; tile += 7) {
            const Warp warp =
                warpFrom(frame.sampleFromPixel(tile, effort.samplesPerPixel) * f.pixelFromSource);
            const auto draw = [&](std::span<const std::uint32_t> some,
                                  std::vector<float>& samples) {
                if (!rasteriseSource(*f.source, warp, some, grid, frame.qLimit(), samples.data()))
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

INSTANTIATE_TEST_SUITE_P(Scenes, PlannedBlocks,
                         testing::Values(AnalyticScene::object, AnalyticScene::room));

}  // namespace
}  // namespace stx::surface
