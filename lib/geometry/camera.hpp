#pragma once

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

#include "lib/base/result.hpp"

namespace stx {

/// A camera: where it is and how it maps the scene to pixels.
///
/// Axes (ISO/IEC 14496-11 Viewpoint, VRML, OpenGL): +X right, +Y up, the camera looks along -Z.
/// Pixels: (0,0) is the top-left corner of the top-left pixel, its centre is (0.5, 0.5), y runs
/// down. Depth ("dist") is planar: the distance to the plane through the viewpoint parallel to the
/// image, in scene units, in both projections.
///
/// The intrinsics are general (a principal point anywhere), more than DepthImage can say; see
/// fieldOfView() for what of it fits.
struct Camera {
    glm::dvec3 position{0.0};                    ///< viewpoint in the world, scene units
    glm::dquat orientation{1.0, 0.0, 0.0, 0.0};  ///< unit; worldFromCamera rotation (w, x, y, z)
    int width = 0;                               ///< pixels
    int height = 0;                              ///< pixels
    bool orthographic = false;
    /// Perspective: focal lengths in pixels. Orthographic: pixels per scene unit. Always > 0.
    double fx = 1.0;
    double fy = 1.0;
    /// The image point of the viewing axis, in pixels; width/2, height/2 when centred.
    double cx = 0.0;
    double cy = 0.0;

    /// The camera of a DepthImage: `fieldOfView` is the full horizontal and vertical angle in
    /// radians, or, when orthographic, the width and height of the window in scene units.
    [[nodiscard]] static Camera fromFieldOfView(glm::dvec3 position, glm::dquat orientation,
                                                glm::dvec2 fieldOfView, bool orthographic,
                                                int width, int height);
    /// DepthImage.fieldOfView of this camera. Exact only when centred().
    [[nodiscard]] glm::dvec2 fieldOfView() const;
    /// The principal point is the image's centre to within `tolerance` pixels.
    [[nodiscard]] bool centred(double tolerance = 1e-9) const;

    /// Camera space from world space: rotate and shift, no scale.
    [[nodiscard]] glm::dmat4 cameraFromWorld() const;
    [[nodiscard]] glm::dmat4 worldFromCamera() const;

    /// Pixel position and dist of a point in camera space. Perspective needs z < 0.
    [[nodiscard]] glm::dvec3 project(glm::dvec3 inCamera) const {
        const double dist = -inCamera.z;
        const double scale = orthographic ? 1.0 : 1.0 / dist;
        return {cx + fx * inCamera.x * scale, cy - fy * inCamera.y * scale, dist};
    }
    /// The point in camera space at pixel position (x, y) and planar distance dist.
    [[nodiscard]] glm::dvec3 unproject(double x, double y, double dist) const {
        const double scale = orthographic ? 1.0 : dist;
        return {(x - cx) / fx * scale, -(y - cy) / fy * scale, -dist};
    }
    /// Scene units between neighbouring pixels' samples at dist: (along x, along y).
    [[nodiscard]] glm::dvec2 sampleSpacing(double dist) const {
        const double scale = orthographic ? 1.0 : dist;
        return {scale / fx, scale / fy};
    }
    /// Unit vector from the viewpoint through a pixel position, in the world. Orthographic: the
    /// axis.
    [[nodiscard]] glm::dvec3 viewDirection(double x, double y) const;
    /// The direction the camera looks in, in the world (-Z of the camera).
    [[nodiscard]] glm::dvec3 forward() const { return orientation * glm::dvec3(0, 0, -1); }

    /// The same view at another resolution.
    [[nodiscard]] Camera resized(int newWidth, int newHeight) const;

    /// Errors on NaN, non-positive focal lengths, empty frames or a quaternion that is not unit.
    [[nodiscard]] Result<void> check() const;

    bool operator==(const Camera&) const = default;
};

/// A direction times the power of two that makes its largest component 0.5 to 1: its length can be
/// taken whatever it was, and its bits stay. As it is where it is 0 or not finite.
[[nodiscard]] glm::dvec3 scaledToOne(glm::dvec3 direction);

/// Orientation of a camera at `eye` that looks at `target`; `up` need not be orthogonal. Errors
/// (usage) when they coincide, are not finite or lie 1e150 and more apart; an `up` along the line
/// of sight is replaced by another axis.
[[nodiscard]] Result<glm::dquat> lookAt(glm::dvec3 eye, glm::dvec3 target,
                                        glm::dvec3 up = {0, 1, 0});

/// SFRotation (unit axis x y z, angle in radians) of a unit quaternion; the angle is in [0, pi]
/// (a hair above for half turns as floats have them).
/// No rotation is 0 0 1 0, the default of the standard.
[[nodiscard]] glm::dvec4 axisAngleFromQuat(glm::dquat q);
/// The inverse; the axis need not be unit. A zero axis means no rotation.
[[nodiscard]] glm::dquat quatFromAxisAngle(glm::dvec4 axisAngle);

}  // namespace stx
