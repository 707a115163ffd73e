#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "lib/panorama/work_copy.hpp"

namespace stx::panorama {

inline constexpr std::size_t kDescriptorSize = 128;  ///< bytes
/// Gradients around a corner, turned with it: 4 x 4 cells of 8 directions, as in SIFT (Lowe 2004),
/// square roots of shares (Arandjelovic, Zisserman 2012) as bytes. Aligned as caches are: they are
/// compared in vectors, by the million.
struct alignas(64) Descriptor : std::array<std::uint8_t, kDescriptorSize> {};

struct Feature {
    glm::vec2 pixel{0};  ///< of the work copy, (0.5, 0.5) is the first pixel's centre
    int level = 0;       ///< it was found in the copy reduced by 2^(level / 2)
    float strength = 0;
};

struct Features {
    std::vector<Feature> points;
    std::vector<Descriptor> descriptors;  ///< of each point; a point may be there twice, turned
};

/// Corners of a picture (Harris and Stephens 1988) at several sizes, the strongest of each part of
/// it, at most about `most`. The same on any number of threads.
[[nodiscard]] Features findFeatures(const WorkCopy& copy, int most);

}  // namespace stx::panorama
