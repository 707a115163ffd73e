#pragma once

#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include "lib/base/job.hpp"

namespace stx {

/// A cloud of Gaussians (Kerbl et al., 3D Gaussian Splatting, 2023): each is an ellipsoid without
/// an edge, with an opacity at its centre and a colour that may change with the direction from
/// which it is seen. Arrays are as long as `positions`, but for `harmonics`.
struct SplatCloud {
    std::vector<glm::vec3> positions;  ///< centres, scene units
    std::vector<glm::vec3> scales;  ///< standard deviations along the own axes, scene units, >= 0
    std::vector<glm::vec4> rotations;  ///< unit quaternion x y z w, turns own axes into the world
    std::vector<float> opacities;      ///< 0..1
    std::vector<glm::vec3> colours;    ///< of degree 0: 0.5 + 0.28209479 times its coefficient
    /// Real spherical harmonics of the degrees 1 to `degree` as half floats: of each splat all
    /// coefficients of red, then green, then blue, each filled up with zeros to paddedCount().
    std::vector<std::uint16_t> harmonics;
    int degree = 0;  ///< 0..3
    /// Colours are blended as linear light (glTF's lin_rec709_display), not as coded sRGB.
    bool linear = false;
    /// The coordinate axis that is up, by the habits of the file's format or by the cameras of the
    /// views that the cloud was made of: not stored in files.
    glm::vec3 up{0, 1, 0};

    /// Coefficients of the degrees 1 to `degree`: 0, 3, 8 or 15.
    [[nodiscard]] static int coefficientCount(int degree) { return degree * (degree + 2); }
    /// The same, filled up to a number that vectors like: 0, 4, 8 or 16.
    [[nodiscard]] static int paddedCount(int degree) { return degree == 0 ? 0 : 2 << degree; }
    /// Sets one coefficient of a splat; `harmonics` must have its size.
    void setHarmonic(std::size_t splat, int coefficient, int channel, float value);

    /// How far splat `i` reaches: column k leads from its centre to the place that is farthest
    /// along +k of those where it hides a quarter or more of what is behind it, scene units; where
    /// some overlap, that is half of it, and pictures have depth. So the box of these places has
    /// half the size (x of column 0, y of 1, z of 2). Of a splat of an opacity below one half it is
    /// where it hides half as much as at its centre.
    [[nodiscard]] glm::dmat3 reach(std::size_t i) const;
    /// What it reaches at most in any direction, if it were opaque: quick to tell.
    [[nodiscard]] double mostReach(std::size_t i) const;

    /// Bytes of one splat of that degree.
    [[nodiscard]] static std::uint64_t bytesEach(int degree) {
        return 56 + 6 * static_cast<std::uint64_t>(paddedCount(degree));
    }
    /// Makes room for `count` splats of `degree`. Errors (invalidInput): over the memory limit.
    [[nodiscard]] Result<void> resize(std::size_t count, int degreeToHold, const Limits& limits);

    /// Whether a picture can show splat `i`: values are finite, sizes 0..1e15, the rotation has a
    /// length, the opacity is not below 0.
    [[nodiscard]] bool isSound(std::size_t i) const;
    /// Takes out splats that are not sound; opacities above 1 become 1, and rotations unit. How
    /// many went is said with a note. Errors (invalidInput): none is left.
    [[nodiscard]] Result<void> dropBroken(Job& job);

    bool operator==(const SplatCloud&) const = default;
};

}  // namespace stx
