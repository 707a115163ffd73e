#include "lib/render/surface/cpu/fuse.hpp"

#include <bit>

#include <gtest/gtest.h>

namespace stx::surface {
namespace {

Camera cameraOf(int size) {
    return Camera::fromFieldOfView({0, 0, 0}, {1, 0, 0, 0}, {1.0, 1.0}, false, size, size);
}

/// A wall across the whole view, facing it.
ReferenceView wallAt(float dist) {
    ReferenceView view;
    view.camera = cameraOf(kTile);
    view.depthBits = 32;
    view.depth = Image<float>(kTile, kTile, dist);
    view.nearPlane = 0.5 * dist;
    view.farPlane = 2 * dist;
    view.texture = Texture(Rgba8Image(kTile, kTile, glm::u8vec4(255)));
    return view;
}

TEST(Fuse, OneSurfaceInAPixelHasNoFlagsWhateverItsMean) {
    // One source shows a wall at 1, another looks past it at a wall at 2. One vote does not reject
    // what is far from any edge; the mean of the samples may be any number.
    Bundle bundle;
    bundle.views = {wallAt(1.0f), wallAt(2.0f)};
    const SurfaceScene scene(bundle);
    const Source &shows = scene.sources[0], &looksPast = scene.sources[1];
    const PixelSpace space(cameraOf(kTile), 4.0);
    const Warp same = warpFrom(glm::dmat4(1.0));
    const SampleGrid grid{2};
    for (std::uint32_t apart = 0; apart < 64; apart += 4) {
        const auto low = std::bit_cast<std::uint32_t>(1.0f);
        std::vector<float> samples(grid.count(), std::bit_cast<float>(low));
        samples[1] = std::bit_cast<float>(low + apart);
        const std::vector<LocalSource> sources{{&shows, same, samples.data()},
                                               {&looksPast, same, nullptr}};
        Pieces pieces;
        fuseTile(sources, grid, space.axis, 0, 0, 1, 1, pieces);
        EXPECT_EQ(pieces.size(), 1u) << "samples " << apart << " steps of a float apart";
    }
}

}  // namespace
}  // namespace stx::surface
