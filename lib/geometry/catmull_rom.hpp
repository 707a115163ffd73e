#pragma once

#include <array>

namespace stx {

/// Catmull-Rom's weights of four neighbours, `t` of the way (0..1) from the second to the third.
[[nodiscard]] inline std::array<float, 4> catmullRomWeights(float t) {
    const float t2 = t * t, t3 = t2 * t;
    return {-0.5f * t3 + t2 - 0.5f * t, 1.5f * t3 - 2.5f * t2 + 1.0f,
            -1.5f * t3 + 2.0f * t2 + 0.5f * t, 0.5f * t3 - 0.5f * t2};
}

}  // namespace stx
