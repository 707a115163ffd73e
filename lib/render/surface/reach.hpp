#pragma once

#include <cmath>
#include <span>

#include <glm/glm.hpp>

#include "lib/geometry/camera.hpp"
#include "lib/render/surface/prepare/source.hpp"

namespace stx {

/// Depths are of one surface within this share, as in splat mode, and steps of their code.
constexpr double kSameDepth = 0.01, kSameSteps = 2.0;

/// Whether a view's picture may show some of a box, which is given by its corners in the world: not
/// where all are beyond one of its sides, by a pixel or more, or behind it.
[[nodiscard]] bool mayShow(const Camera& c, std::span<const glm::dvec3> corners);

/// A view, and between which distances along its axis all lies that it shows, so that what is
/// beyond need not be asked of. All that is needed for that is here: views lie far apart in memory,
/// and each triangle of one may be held against thousands.
class Reach {
  public:
    explicit Reach(const surface::Source& source);

    [[nodiscard]] const surface::Source& source() const { return *source_; }
    /// Whether a place in the world may be at the depth of what the view shows (kSameDepth).
    [[nodiscard]] bool holds(glm::dvec3 world) const {
        const double dist = distOf(world);
        return holds(dist, dist);
    }
    /// The same of a place in a box, which is given by its corners.
    [[nodiscard]] bool holds(std::span<const glm::dvec3> corners) const;

  private:
    [[nodiscard]] double distOf(glm::dvec3 world) const {
        return glm::dot(forward_, world) - position_;
    }
    [[nodiscard]] bool holds(double low, double high) const {
        // A little more, for rounding.
        constexpr double kShare = 1.1 * kSameDepth;
        return !(low - kShare * std::abs(low) > farthest_ ||
                 high + kShare * std::abs(high) < nearest_);
    }

    const surface::Source* source_;
    glm::dvec3 forward_;
    double position_;  ///< along forward_; scene units, as all others
    double nearest_ = 0, farthest_ = 0;
};

}  // namespace stx
