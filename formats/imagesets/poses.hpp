#pragma once

#include <span>
#include <string>

#include <glm/glm.hpp>

#include "lib/base/job.hpp"
#include "lib/geometry/camera.hpp"

namespace stx::imagesets {

/// The 3x3 matrix of three rows of four numbers (R | t), one after the other.
[[nodiscard]] inline glm::dmat3 rotationOfRows(std::span<const double> rows) {
    return glm::transpose(glm::dmat3(rows[0], rows[1], rows[2], rows[4], rows[5], rows[6], rows[8],
                                     rows[9], rows[10]));
}

/// The nearest rotation to a matrix that should be one (its polar factor). Corrections that move a
/// pixel by more than 0.01 (for a focal length of `focalPixels`) are noted with their size. Errors:
/// values that are not finite, singular matrices, and those further than 0.05 from a rotation or a
/// mirrored rotation.
[[nodiscard]] Result<glm::dmat3> repairRotation(const glm::dmat3& matrix, double focalPixels,
                                                const std::string& where, Job& job);

/// A calibrated pinhole as computer vision has it: image point (fx x/z + cx, fy y/z + cy) of a
/// point in camera space, z forward, pixel rows downward. Negative fx or fy are axes the other way
/// round.
struct VisionCamera {
    glm::dmat3 worldFromCamera{1.0};  ///< a rotation
    glm::dvec3 centre{0.0};           ///< in the world
    double fx = 1, fy = 1;            ///< pixels; either sign
    double cx = 0, cy = 0;            ///< pixels; the first pixel's centre is (0.5, 0.5)
    int width = 0, height = 0;

    /// The camera's right, down and forward form a left-handed frame, so its world does, too.
    [[nodiscard]] bool leftHanded() const { return (fx < 0) != (fy < 0); }
};

/// The same camera in our axes. The world of left-handed sets is mirrored, z negated, as must be
/// everything else in it; sets are of one kind throughout.
[[nodiscard]] Camera cameraFromVision(const VisionCamera& vision);

/// Whether the numbers of a pose are those of a camera. Trackers that lost their way write nan or
/// inf.
[[nodiscard]] bool isTracked(std::span<const double> pose);
/// Says that so many of a file's poses are of lost tracking. Errors when all are, or `strict`.
[[nodiscard]] Result<void> noteLost(std::size_t lost, std::size_t all, const std::string& where,
                                    bool strict, Job& job);

/// Rotation of a quaternion x y z w, which need not be unit. Errors when it is zero or not finite.
[[nodiscard]] Result<glm::dmat3> rotationFromQuaternion(glm::dvec4 xyzw, const std::string& where);

}  // namespace stx::imagesets
