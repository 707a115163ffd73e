#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "lib/model/reference_view.hpp"

namespace stx {

/// Resolutions that colours are compared at, halved each time: the coarsest lets poses be off by
/// some ten pixels.
inline constexpr int kPoseLevels = 3;

/// What views are registered by: smaller images of one view.
struct PoseSample {
    ViewHeader header;  ///< its camera has the size of `depth`
    Image<float>
        depth;  ///< distances, scene units; kNoDepth: no point, or an edge between surfaces
    /// Grey values 0..1 (sRGB), the first of the size of `depth`, each half as large as the one
    /// before.
    std::vector<Image<float>> grey;
};

/// Of a view, whose images are halved until they have `mostPixels` at most.
[[nodiscard]] PoseSample poseSampleOf(
    const ReferenceView& view,
    std::uint64_t mostPixels = std::numeric_limits<std::uint64_t>::max());
/// Of all of these views.
[[nodiscard]] std::vector<PoseSample> poseSamplesOf(
    const std::vector<ReferenceView>& views,
    std::uint64_t mostPixels = std::numeric_limits<std::uint64_t>::max());

/// Pixels that samples of so many views may have each: 640x480, fewer of more than ten views, so
/// that all take 32 MB. Poses by samples of 160x120 lose 0.5 dB of what is drawn of a Kinect's
/// 640x480, by 320x240 0.3 dB.
[[nodiscard]] std::uint64_t samplePixels(std::size_t views);

}  // namespace stx
