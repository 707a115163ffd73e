#pragma once

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

#include "lib/base/result.hpp"
#include "lib/geometry/camera.hpp"
#include "lib/model/reference_view.hpp"

namespace stx::mpeg4 {

/// The matrix of a Transform node: T(translation) C SR S SR^-1 R ... as ISO/IEC 14496-11 and VRML97
/// 6.52 define it: translation * center * rotation * scaleOrientation * scale * -scaleOrientation *
/// -center. Rotations are SFRotation values.
[[nodiscard]] glm::dmat4 transformMatrix(glm::dvec3 center, glm::dvec4 rotation, glm::dvec3 scale,
                                         glm::dvec4 scaleOrientation, glm::dvec3 translation);

/// A frame that a camera can be moved through: a rotation, one scale and a shift.
struct Similarity {
    double scale = 1.0;  ///< > 0
    glm::dquat rotation{1, 0, 0, 0};
    glm::dvec3 translation{0.0};

    [[nodiscard]] bool isIdentity() const {
        return scale == 1.0 && rotation == glm::dquat(1, 0, 0, 0) && translation == glm::dvec3(0.0);
    }
};

/// The matrix as a similarity. Errors (invalidInput) when it scales the axes unlike, shears,
/// mirrors, flattens or is not finite: a DepthImage's camera cannot express that.
[[nodiscard]] Result<Similarity> similarityFrom(const glm::dmat4& worldFromLocal);

/// Moves a view, with planes, normals, splats and depth, from a local frame into the world.
void applySimilarity(ReferenceView& view, const Similarity& worldFromLocal);

/// Whether the planes of a DepthImage are around its points. A view without a point is written with
/// the values that the fields have by themselves.
[[nodiscard]] inline bool planesSaySomething(double nearPlane, double farPlane) {
    return nearPlane != 10.0 || farPlane != 100.0;
}

/// How a view's image is widened so that its principal point is the centre, which a DepthImage
/// needs.
struct Padding {
    int left = 0, top = 0, right = 0, bottom = 0;  ///< pixels without a point
    Camera camera;                                 ///< of the padded image, centred
    double shift = 0.0;  ///< pixels by which the principal point had to be moved, at most 0.36

    [[nodiscard]] bool any() const { return left + top + right + bottom > 0; }
};

/// Padding in whole pixels, never cropping; what is left is less than a quarter pixel along each
/// axis and is taken by moving the principal point. An orthographic camera is shifted instead,
/// which is exact. Errors: unsupported when the padded image would have more than `maxSide` pixels
/// on a side.
[[nodiscard]] Result<Padding> centringPadding(const Camera& camera, int maxSide);

}  // namespace stx::mpeg4
