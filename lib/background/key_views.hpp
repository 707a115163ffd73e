#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "lib/model/reference_view.hpp"

namespace stx::temporal {

/// What a camera sees at one moment, on a coarse grid: enough to tell which moments are worth
/// keeping.
struct Glimpse {
    Camera camera;
    Image<float> depth;  ///< of pixels spread evenly over the picture

    /// The pixel position of a place in the grid.
    [[nodiscard]] glm::dvec2 pixelOf(int x, int y) const {
        return {(x + 0.5) * camera.width / depth.width(),
                (y + 0.5) * camera.height / depth.height()};
    }
};

[[nodiscard]] Glimpse glimpseOf(const ReferenceView& view);

/// How many points of one glimpse the other sees, too, as fine.
[[nodiscard]] std::int64_t sharedPoints(const Glimpse& one, const Glimpse& other);

/// Numbers of the glimpses, `most` at most, that together see what all of them see, as fine as any
/// of them does (greedy cover of the points): those that add most first. Stops where one more would
/// add less than a hundredth of all points. Empty when none sees anything.
[[nodiscard]] std::vector<int> chooseKeys(std::span<const Glimpse> glimpses, int most);

}  // namespace stx::temporal
