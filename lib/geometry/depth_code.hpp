#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

namespace stx {

/// "No point of the object here", in depth images held as float distances.
inline constexpr float kNoDepth = std::numeric_limits<float>::infinity();

[[nodiscard]] inline bool hasPoint(float dist) {
    return dist < kNoDepth;
}

/// The depth code of DepthImage (ISO/IEC 14496-16, 4.5.4): d = dmax is nearPlane, d = 1 is
/// farPlane, d = 0 is not a point of the object.
struct DepthCode {
    double nearPlane = 10.0;   ///< scene units
    double farPlane = 100.0;   ///< scene units, > nearPlane
    std::uint32_t dmax = 255;  ///< 255 or 65535

    /// Distance of a code; kNoDepth for 0.
    [[nodiscard]] double decode(std::uint32_t d) const {
        if (d == 0) return kNoDepth;
        return nearPlane + (1.0 - (d - 1.0) / (dmax - 1.0)) * (farPlane - nearPlane);
    }
    /// Nearest code of a distance, clamped to 1..dmax so that a valid point never becomes "none";
    /// 0 for kNoDepth (and NaN).
    [[nodiscard]] std::uint32_t encode(double dist) const {
        if (!(dist < kNoDepth)) return 0;
        const double d =
            std::round(1.0 + (dmax - 1.0) * (farPlane - dist) / (farPlane - nearPlane));
        if (d < 1.0) return 1;
        if (d > dmax) return dmax;
        return static_cast<std::uint32_t>(d);
    }
    /// Scene units between neighbouring codes; the largest error is half of it.
    [[nodiscard]] double step() const { return (farPlane - nearPlane) / (dmax - 1.0); }
};

}  // namespace stx
