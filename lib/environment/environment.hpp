#pragma once

#include <array>
#include <vector>

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

#include "lib/base/result.hpp"
#include "lib/model/texture.hpp"

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

/// What is seen in each direction, infinitely far away: pictures, before a ground, before a sky
/// (VRML97's Background; all three may be missing, and then nothing is seen there).
struct Environment {
    enum class Layout {
        cube,             ///< six pictures in the order of CubeFace; any may be empty
        equirectangular,  ///< one picture all around, see latlongDirection()
    };
    Layout layout = Layout::cube;
    /// 8-bit sRGB or linear light, all alike; straight alpha lets ground and sky through.
    std::vector<Texture> pictures;
    /// Unit; turns directions of the environment into the world's (worldFromEnvironment).
    glm::dquat orientation{1.0, 0.0, 0.0, 0.0};
    /// sRGB-coded 0..1: the first straight up, the others at skyAngles (radians from there, rising,
    /// one less than colours), mixed evenly between, the last from there on down. Empty: no sky.
    std::vector<glm::vec3> skyColours;
    std::vector<double> skyAngles;
    /// The same from straight down; the ground ends at its last angle, with one colour alone
    /// nowhere.
    std::vector<glm::vec3> groundColours;
    std::vector<double> groundAngles;

    /// Some picture is linear light, not 8-bit sRGB.
    [[nodiscard]] bool linear() const;
    /// Faces or the equirectangular picture that are there.
    [[nodiscard]] int pictureCount() const;
    /// Errors (invalidInput): no picture, sky or ground at all, another number of pictures than the
    /// layout has, colours of both kinds, an orientation that is not a rotation, angles that do not
    /// rise or are not one less than their colours.
    [[nodiscard]] Result<void> check() const;
    bool operator==(const Environment&) const = default;
};

}  // namespace stx
