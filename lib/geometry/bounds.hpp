#pragma once

#include <limits>

#include <glm/glm.hpp>

namespace stx {

/// An axis-aligned box in the world, scene units; empty until something was added.
struct Bounds {
    glm::dvec3 min{std::numeric_limits<double>::infinity()};
    glm::dvec3 max{-std::numeric_limits<double>::infinity()};

    void add(glm::dvec3 p) {
        min = glm::min(min, p);
        max = glm::max(max, p);
    }
    [[nodiscard]] bool empty() const { return !(min.x <= max.x); }
    [[nodiscard]] glm::dvec3 centre() const { return (min + max) * 0.5; }
    /// Radius of the sphere around centre() that holds the box.
    [[nodiscard]] double radius() const { return empty() ? 0.0 : glm::length(max - min) * 0.5; }

    bool operator==(const Bounds&) const = default;
};

}  // namespace stx
