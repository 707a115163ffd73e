#pragma once

#include <optional>
#include <vector>

#include "lib/model/reference_view.hpp"

/// Solids with exact formulas: what a ray meets is computed, not drawn.
struct Solid {
    enum class Kind { ball, box, torus, cone, room };
    Kind kind = Kind::ball;
    glm::dvec3 centre{0.0};
    glm::dquat worldFromSolid{1, 0, 0, 0};  ///< unit
    /// ball: x is the radius. box, room: half the sides. torus: radius of the ring (x) and of the
    /// tube (y) around the Y axis. cone: radius of the base (x) and half the height (y), tip up.
    glm::dvec3 size{1.0};
    int openFace = -1;  ///< of a room: a side without a wall, 0..5; -1: it has all
};

/// Where a ray meets a scene.
struct Hit {
    double t = 0;      ///< along the ray, whose direction is a unit vector
    int surface = -1;  ///< one number for each smooth surface; -1: nothing is there
    glm::dvec3 point{0}, normal{0};

    [[nodiscard]] bool any() const { return surface >= 0; }
};

/// Solids in scene units, with a texture that is a sum of waves of the position.
struct Scene {
    std::vector<Solid> solids;
    double waves = 4;  ///< of the texture: radians per scene unit

    [[nodiscard]] Hit trace(glm::dvec3 origin, glm::dvec3 direction) const;
    [[nodiscard]] Hit trace(const stx::Camera& camera, double x, double y) const;
    [[nodiscard]] glm::dvec3 colourAt(glm::dvec3 point, int surface) const;
    /// Points on the outside of the solids, for framing.
    [[nodiscard]] std::vector<glm::vec3> points() const;
};

/// What a camera sees: colour and coverage are means over each pixel's area (5 rays inside of a
/// surface, 1 + 16 where it ends or bends), depth is that of the pixel's centre.
[[nodiscard]] stx::ReferenceView look(const Scene& scene, const stx::Camera& camera);
