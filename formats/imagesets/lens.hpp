#pragma once

#include <optional>

#include <glm/glm.hpp>

#include "lib/geometry/camera.hpp"

namespace stx::imagesets {

/// A rectangle of whole pixels.
struct PixelRectangle {
    int x = 0, y = 0;  ///< its first pixel
    int width = 0, height = 0;
};

/// What a real camera does to an ideal pinhole's picture. Coordinates as in OpenCV and COLMAP: x
/// right, y down, of the plane at distance 1:
/// x' = x (1 + k1 r2 + k2 r4 + k3 r6) + 2 p1 x y + p2 (r2 + 2 x x), y' alike; then the image point
/// is (fx (x' + skew y') + cx, fy y' + cy). SIMPLE_RADIAL: k1; RADIAL: k1 k2; OPENCV: k1 k2 p1 p2.
/// With `rational` (FULL_OPENCV, Azure Kinect) the radial factor is divided by 1 + k4 r2 + k5 r4 +
/// k6 r6.
struct Lens {
    double k1 = 0, k2 = 0, k3 = 0, p1 = 0, p2 = 0;
    double skew = 0;  ///< pixels / fx: pictures of all sizes have the same
    /// OPENCV_FISHEYE instead: t = atan r, x' = x / r * t (1 + k1 t2 + k2 t4 + k3 t6 + k4 t8);
    /// p1 and p2 are not used.
    bool fisheye = false;
    double k4 = 0;
    bool rational = false;
    double k5 = 0, k6 = 0;

    [[nodiscard]] bool ideal() const { return !distorts() && skew == 0; }
    [[nodiscard]] bool distorts() const {
        return fisheye || rational || k1 != 0 || k2 != 0 || k3 != 0 || p1 != 0 || p2 != 0;
    }
    /// Where the pixel position of the ideal pinhole is in the real picture.
    [[nodiscard]] glm::dvec2 realFromIdeal(const Camera& camera, glm::dvec2 pixel) const;
    /// The largest shift over the picture, in pixels.
    [[nodiscard]] double largestShift(const Camera& camera) const;
    /// Whether the real picture, which has the camera's size, shows what the ideal pinhole sees at
    /// a pixel position.
    [[nodiscard]] bool isShown(const Camera& camera, glm::dvec2 pixel) const;
    /// A large rectangle of the ideal pinhole's picture that the real one shows, all of it: what
    /// lies around is not known. Its sides give way where most is missing. An even side stays even,
    /// as films are coded so that all players take them. Width 0: there is none. The lens must be
    /// invertible().
    [[nodiscard]] PixelRectangle shownPart(const Camera& camera) const;
    /// The share 0..1 of the real picture's area that is not in such a rectangle, so that it is cut
    /// away. Right to about 0.002; the lens must be invertible().
    [[nodiscard]] double cutShare(const Camera& camera, const PixelRectangle& kept) const;
    /// The mapping does not fold inside the picture: it can be undone.
    [[nodiscard]] bool invertible(const Camera& camera) const;
};

/// A focal length along one axis as a file says it, in pixels or as an angle of view in radians.
struct Focal {
    std::optional<double> pixels, angle;

    [[nodiscard]] bool said() const { return pixels || angle; }
    /// Of a picture of that side; said() must be true.
    [[nodiscard]] double of(int side) const;
};

/// What a file says of a pinhole: what it leaves out follows from the size of the picture.
struct Pinhole {
    Focal x, y;                    ///< y not said: square pixels
    std::optional<double> cx, cy;  ///< not said: the middle

    /// Fills in the camera's intrinsics by its size.
    void fill(Camera& camera) const;
    /// The size in whose middle the principal point is; nothing: it is not said, or no picture has
    /// that size.
    [[nodiscard]] std::optional<glm::ivec2> sizeAround() const;
};

}  // namespace stx::imagesets
