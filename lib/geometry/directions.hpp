#pragma once

#include <array>

#include <glm/glm.hpp>

namespace stx {

/// The faces of a cube around the viewer, seen from inside, in the order of all lists of faces.
/// Where they are and how they are turned is VRML97's (Background, ISO/IEC 14772-1, 6.5): position
/// (u, v) in 0..1 from the upper left, a = 2u-1, b = 1-2v, looks along
///     front (a, b, -1) · back (-a, b, 1) · left (-1, b, -a) · right (1, b, a) ·
///     top (a, 1, b) · bottom (a, -1, -b).
enum class CubeFace { front, back, left, right, top, bottom };
inline constexpr std::array<const char*, 6> kCubeFaceNames = {"front", "back", "left",
                                                              "right", "top",  "bottom"};

/// The direction of a position on a face: the component that points at the face is 1 or -1.
[[nodiscard]] glm::dvec3 faceDirection(CubeFace face, glm::dvec2 position);

struct FacePosition {
    CubeFace face = CubeFace::front;
    glm::dvec2 position{0.5};
};
/// The inverse, of any direction but 0.
[[nodiscard]] FacePosition facePosition(glm::dvec3 direction);

/// The unit direction of a position (0..1, 0..1 from the upper left) in an equirectangular picture:
/// -Z in the middle, +X to the right of it, +Y on top.
[[nodiscard]] glm::dvec3 latlongDirection(glm::dvec2 position);
/// The inverse; x in 0..1.
[[nodiscard]] glm::dvec2 latlongPosition(glm::dvec3 direction);

}  // namespace stx
