#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "lib/base/result.hpp"
#include "lib/geometry/bounds.hpp"
#include "lib/geometry/camera.hpp"

namespace stx {

/// A named arrangement of cameras around an object (`--views`).
struct ViewLayout {
    enum class Kind {
        cube,    ///< the six faces: +X -X +Y -Y +Z -Z, always 6
        ring,    ///< `count` around +Y at one elevation, the first on +Z, counter-clockwise from
                 ///< above
        sphere,  ///< `count` on a Fibonacci sphere: even in all directions
        octahedral,      ///< `count` x `count`, octahedral map row by row: the impostor grid
        hemiOctahedral,  ///< the same of the upper half, for what stands on the ground
    };
    Kind kind = Kind::sphere;
    int count = 16;
    double elevationRad = 0.0;  ///< of a ring, above the horizon
};

/// How the cameras of a layout look at the object.
struct ViewFraming {
    int width = 512, height = 512;  ///< pixels of each view
    bool orthographic = false;
    double fovRad =
        0.6;  ///< perspective: angle that the object's bounding sphere fills; sets the distance
    int marginPixels = 2;  ///< kept free around the object
    /// The object's up axis: what layouts stand on, and up in the pictures. Need not be unit.
    glm::dvec3 up{0, 1, 0};
};

/// Parses `cube`, `ring:N`, `sphere:N`, `octahedral:N`, `hemi-octahedral:N`. Errors (usage) name
/// the possible forms.
[[nodiscard]] Result<ViewLayout> parseViewLayout(std::string_view text);

/// The shortest rotation that takes +Y to `up` (which need not be unit). So the front, +Z, of an
/// object that stands on +Z is -Y, as in programs whose models do.
[[nodiscard]] glm::dquat rotationToUp(glm::dvec3 up);

/// The rotation that takes an object whose up is `from` to one whose up is `to`, both coordinate
/// axes; its numbers are whole. +Y goes to `to` as by rotationToUp().
[[nodiscard]] glm::dmat3 turnOfUp(glm::dvec3 from, glm::dvec3 to);

/// What it makes of coordinates, for people: "x z -y".
[[nodiscard]] std::string turnedAxes(const glm::dmat3& turn);

/// The coordinate axis along which cameras stand upright: none is tilted sideways against it by
/// more than some degrees. +Y when it is one of these, or when none is.
[[nodiscard]] glm::dvec3 upOfCameras(const std::vector<Camera>& cameras);

/// What is up in the picture of a camera on a ring around an object whose up is +Y, which is a
/// point in the picture from straight above or below: what lies away from the viewer is up there,
/// as just beside, so that pictures turn with `aroundRad` (from +Z, counter-clockwise from above).
/// Nothing elsewhere, where the object's up serves.
[[nodiscard]] std::optional<glm::dvec3> upAtPole(double aroundRad, double elevationRad);

/// Unit vectors from the object towards the cameras, in order, of an object whose up is +Y.
[[nodiscard]] std::vector<glm::dvec3> layoutDirections(const ViewLayout& layout);

/// Direction of cell (i, j) of an N x N octahedral map, 0 <= i, j < n: the corners and edges of the
/// grid are the lower pole's. As in impostor shaders: p = 2 (i, j)/(n-1) - 1, folded where
/// |p.x| + |p.y| > 1; +Y is the pole in the middle.
[[nodiscard]] glm::dvec3 octahedralDirection(int i, int j, int n);

/// The same of an N x N hemi-octahedral map: with p as above, x = (p.x + p.y) / 2,
/// z = (p.x - p.y) / 2, y = 1 - |x| - |z|. The edges of the grid are the horizon.
[[nodiscard]] glm::dvec3 hemiOctahedralDirection(int i, int j, int n);

/// Cameras of a layout around points (the object's vertices, or the corners of its box). Each looks
/// at the centre of the bounds. The frame is drawn in until the object fills it, with
/// square pixels, except in octahedral layouts, where all views have the same window (impostor
/// shaders rely on it). Errors when there are no points.
[[nodiscard]] Result<std::vector<Camera>> layoutCameras(const ViewLayout& layout,
                                                        const ViewFraming& framing,
                                                        const std::vector<glm::vec3>& points);

/// A sphere around points: the centre of their box and the distance of the farthest.
struct BoundingSphere {
    glm::dvec3 centre{0.0};
    double radius = 0.0;
};
[[nodiscard]] BoundingSphere boundingSphere(const std::vector<glm::vec3>& points);

/// One camera on a direction from the sphere's centre, framed as layoutCameras() does: `tight`
/// draws the frame in to the points, else the whole sphere stays in it.
[[nodiscard]] Result<Camera> frameCamera(glm::dvec3 direction, const ViewFraming& framing,
                                         const std::vector<glm::vec3>& points,
                                         const BoundingSphere& sphere, bool tight);

}  // namespace stx
