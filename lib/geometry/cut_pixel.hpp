#pragma once

#include <algorithm>
#include <cmath>

namespace stx {

/// Area of the part of a unit square, centred at the origin, on which n . x < t; n has length 1.
[[nodiscard]] inline float areaBelow(float t, float nx, float ny) {
    const float a = std::max(std::abs(nx), std::abs(ny)), b = std::min(std::abs(nx), std::abs(ny));
    const float half = 0.5f * (a + b), size = std::abs(t);
    if (size >= half) return t > 0 ? 1.0f : 0.0f;
    if (size <= 0.5f * (a - b)) return 0.5f + t / a;
    const float corner = (half - size) * (half - size) / (2 * a * b);
    return t > 0 ? 1.0f - corner : corner;
}

/// The t for which areaBelow() is `area`, 0..1.
[[nodiscard]] inline float belowOfArea(float area, float nx, float ny) {
    const float a = std::max(std::abs(nx), std::abs(ny)), b = std::min(std::abs(nx), std::abs(ny));
    const float less = std::min(area, 1 - area);
    const float size =
        2 * a * less < b ? 0.5f * (a + b) - std::sqrt(2 * a * b * less) : (0.5f - less) * a;
    return area < 0.5f ? -size : size;
}

}  // namespace stx
