#pragma once

#include <cstddef>
#include <cstdint>

#include <glm/glm.hpp>

#include "lib/render/surface/prepare/source.hpp"

namespace stx::surface {

/// q of `count` pixels from their distances, by 1 / distance; `none`, or 0 where `covered` is 0,
/// for those without a point.
void invertDistances(const float* distances, const std::uint8_t* covered, std::size_t count,
                     float none, float* q);

/// Pixels of a draft.
struct DraftCounts {
    std::int64_t points = 0;   ///< q above 0
    std::int64_t object = 0;   ///< points, or covered
    std::int64_t covered = 0;  ///< covered is not 0
};
[[nodiscard]] DraftCounts countPixels(const float* q, const std::uint8_t* covered,
                                      std::size_t count);

/// A row of q between its neighbours; rows beyond the picture are 0.
struct LinkRows {
    const float *above = nullptr, *here = nullptr, *below = nullptr, *second = nullptr;
    bool first = false, last = false;  ///< of the picture
};
/// The bits of Info for `width` pixels, whose edge distances stay 0. `step`: scene units, of the
/// depth code or what noise makes of it.
void linkRow(const LinkRows& rows, int width, const DepthAxis& axis, float step,
             std::uint8_t* info);

/// Makes the colours sharper of those of `count` pixels that are on one surface with their
/// neighbours and at least `fromEdge` pixels from an edge: each channel gets share / 64 (up to 31 /
/// 64) more of its difference to the mean of its four neighbours. `from`, `info` (see Info) and
/// `to` point at the first of them, `stride` pixels from the one below; neighbours must be there to
/// read. How many it did: it leaves the last of a row, too few for a vector.
[[nodiscard]] std::size_t sharpenRow(const glm::u8vec4* from, const std::uint8_t* info,
                                     std::ptrdiff_t stride, std::size_t count, int fromEdge,
                                     int share, glm::u8vec4* to);

}  // namespace stx::surface
