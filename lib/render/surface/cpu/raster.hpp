#pragma once

#include <cstdint>
#include <span>

#include "lib/render/surface/constants.hpp"
#include "lib/render/surface/source.hpp"

namespace stx::surface {

/// Floats of room after each row of samples, so that whole vectors may be loaded and stored.
inline constexpr int kSamplePadding = 16;

/// The samples of one tile: `side` x `side`, sample (i, j) at tile pixel ((i + ½) / S, (j + ½) /
/// S).
struct SampleGrid {
    int perPixel = 1;  ///< S, samples along one side of a pixel
    [[nodiscard]] int side() const { return kTile * perPixel; }
    [[nodiscard]] int stride() const { return side() + kSamplePadding; }
    [[nodiscard]] std::size_t count() const { return static_cast<std::size_t>(side()) * stride(); }
};

/// Draws blocks of one source as a surface into a tile: the nearest q at each sample, 0 where the
/// source has nothing, with kSampleFlags in its lowest bits. Surfaces seen from behind are left
/// out. `sampleFromSource` maps source pixel positions to sample indices; q beyond `qLimit` is cut
/// off. False when nothing of it shows there: then `samples` are left as they were.
[[nodiscard]] bool rasteriseSource(const Source& source, const Warp& sampleFromSource,
                                   std::span<const std::uint32_t> blocks, const SampleGrid& grid,
                                   float qLimit, float* samples);

}  // namespace stx::surface
