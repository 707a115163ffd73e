#pragma once

#include <cstdint>
#include <span>

#include "lib/render/surface/cpu/raster.hpp"
#include "lib/render/surface/prepare/votes.hpp"

namespace stx::surface {

/// Samples of a pixel, at most: 4 a side.
inline constexpr int kMostSamples = 16;

/// What the samples of a pixel show, row by row.
struct alignas(64) ShownSamples {
    float q[kMostSamples];               ///< 0 = nothing
    std::uint32_t seenBy[kMostSamples];  ///< bit i: local source i sees it
};

/// A tile to fuse: its sources, at most kMostTileSources, and their samples.
struct SampledTile {
    std::span<const LocalSource> sources;
    SampleGrid grid;  ///< at most 4 samples a side
    const DepthAxis& axis;
    float step = 0;  ///< the largest of the sources' Source::step
    int x = 0, y = 0;
};

/// fuseSample() of shaders/shared/surface_fuse.glsl for all samples of pixel (column, row) of a
/// tile, a vector of them at once. `among`: the sources that may have something in the pixel.
void fuseSamplesOf(const SampledTile& tile, std::span<const int> among, int column, int row,
                   ShownSamples& out);

}  // namespace stx::surface
