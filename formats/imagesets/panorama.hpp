#pragma once

#include <vector>

#include <glm/glm.hpp>

#include "lib/geometry/camera.hpp"

namespace stx::imagesets {

/// An equirectangular picture: columns are longitudes, rows latitudes. Longitude 0 is straight
/// ahead (-Z of the camera) and grows to the left, as in MIV; latitude grows upward (+Y).
struct Panorama {
    double left = 3.14159265358979323846;    ///< longitude of the left edge, radians
    double right = -3.14159265358979323846;  ///< of the right edge, < left
    double top = 1.57079632679489661923;     ///< latitude of the upper edge
    double bottom = -1.57079632679489661923;

    /// All around, so that columns may be fetched across the edge.
    [[nodiscard]] bool closed() const;
    /// Unit vector in camera space of a position in the picture (0..1, 0..1), from the upper left.
    [[nodiscard]] glm::dvec3 direction(glm::dvec2 position) const;
    /// The position (0..1 where the picture is) of a direction in camera space.
    [[nodiscard]] glm::dvec2 position(glm::dvec3 direction) const;
};

/// The six cube faces around the camera: front, left, back, right, up, down. Each sees 90 degrees
/// and one pixel more on every side, so that neighbours overlap; pixels are as dense as those in
/// the middle of a panorama of that width.
[[nodiscard]] std::vector<Camera> cubeFaces(const Camera& pose, const Panorama& panorama, int width,
                                            int height);

}  // namespace stx::imagesets
