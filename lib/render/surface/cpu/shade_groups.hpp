#pragma once

#include <cstdint>

#include "lib/render/surface/prepare/source.hpp"

namespace stx::surface {

/// Pieces are shaded in groups of this many, whatever the vector length.
inline constexpr int kGroup = 16;
inline constexpr int kTaps = 4;

struct alignas(64) Lanes {
    float v[kGroup];
    float& operator[](int i) { return v[i]; }
    const float& operator[](int i) const { return v[i]; }
};

/// One source under a group of pieces.
struct GroupSource {
    Lanes u, v;            ///< position in the source, pixels
    Lanes xu, xv, yu, yv;  ///< d(x, y in the frame) / d(u, v)
    Lanes weight;
    bool active = false;
    /// How far taps reach along either axis, pixels of the source; taps beyond have no weight
    /// (kNarrowReach).
    Lanes reach;
    /// All pieces have that short reach: three taps a side are enough, from the one before the
    /// nearest on.
    bool narrow = false;
    /// A bit for each lane that is near an edge. All taps of others lie on one surface, fully
    /// covered.
    std::uint32_t rough = 0;
    TapPlace taps[kGroup];  ///< of sources that are not whole

    /// Where the taps of a lane are, from pixel (baseU, baseV) on.
    [[nodiscard]] TapPlace tapsOf(const Source& source, int lane, int baseU, int baseV) const {
        return source.whole ? source.tapPlaceOf(baseU, baseV) : taps[lane];
    }
};

struct Group {
    const float* x;
    const float* y;
    const float* q;
    const float* qx;
    const float* qy;
    const std::uint32_t* sources;
    int count;
};

}  // namespace stx::surface
