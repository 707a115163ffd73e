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

/// How many points of `one` are also seen by `other`, with pixels that are about as fine there.
[[nodiscard]] std::int64_t sharedPoints(const Glimpse& one, const Glimpse& other);

/// Chooses at most `most` glimpses that together show the points of all glimpses, each point with
/// pixels about as fine as those of the glimpse that shows it finest. A greedy cover: the glimpse
/// that adds most points comes first, and it ends when one more would add less than a hundredth of
/// all points. Gives their indices; empty when no glimpse has a point.
[[nodiscard]] std::vector<int> chooseKeys(std::span<const Glimpse> glimpses, int most);

}  // namespace stx::temporal
