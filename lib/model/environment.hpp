#pragma once

#include <vector>

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

#include "lib/base/result.hpp"
#include "lib/geometry/directions.hpp"
#include "lib/model/texture.hpp"

namespace stx {

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
