#pragma once

#include "lib/base/image.hpp"

namespace stx {

/// q = q0 + gx dx + gy dy around a pixel.
struct LocalPlane {
    float q0 = 0, gx = 0, gy = 0;
    int points = 0;
    float alike = 0;  ///< how many points of full weight would say as much
};

/// The weighted least-squares plane of the points around (x, y) that are near a plane; far ones
/// count less. That plane itself, where they do not tell. `q`: DepthAxis::q(), 0 or less: no point.
[[nodiscard]] LocalPlane fitAround(const Image<float>& q, int x, int y, int radius,
                                   const LocalPlane& near, float band);

}  // namespace stx
