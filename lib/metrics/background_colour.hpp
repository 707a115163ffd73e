#pragma once

#include <glm/glm.hpp>

#include "lib/base/result.hpp"

namespace stx::metrics {

/// Error (usage) unless a colour that is laid behind a picture is three numbers of 0 to 1: pictures
/// over NaN would never differ.
[[nodiscard]] inline Result<void> checkBackground(glm::vec3 colour) {
    for (int c = 0; c < 3; ++c)
        if (!(colour[c] >= 0 && colour[c] <= 1))
            return fail(ErrorCode::usage,
                        "the background is {:g}, {:g}, {:g}; values of 0 to 1 are expected",
                        colour.r, colour.g, colour.b);
    return {};
}

}  // namespace stx::metrics
