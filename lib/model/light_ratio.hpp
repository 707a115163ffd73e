#pragma once

#include <span>

#include <glm/glm.hpp>

namespace stx {

/// One surface under two lights: colours of 0..1.
struct LitPair {
    glm::vec3 a, b;
};

/// How much brighter b is than a, for each channel, whatever a part of the pairs says that shows
/// something else, is in shadow, or is too dark or too bright to tell. Within a factor of two;
/// 1 when too few pairs are left.
[[nodiscard]] glm::vec3 lightRatio(std::span<const LitPair> pairs);

}  // namespace stx
