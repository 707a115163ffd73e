#include "lib/geometry/frustum.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace stx {

std::array<glm::dvec3, 8> frustumCorners(const Camera& camera, double nearest, double farthest) {
    std::array<glm::dvec3, 8> corners{};
    for (int i = 0; i < 8; ++i)
        corners[i] =
            camera.position + camera.orientation * camera.unproject(i & 1 ? camera.width : 0,
                                                                    i & 2 ? camera.height : 0,
                                                                    i & 4 ? farthest : nearest);
    return corners;
}

bool apart(const Camera& camera, double nearest, double farthest, const Bounds& box, double slack) {
    if (box.empty()) return false;
    Bounds seen;
    for (const glm::dvec3& corner : frustumCorners(camera, nearest, farthest)) seen.add(corner);
    if (glm::any(glm::greaterThan(seen.min, box.max + slack)) ||
        glm::any(glm::lessThan(seen.max, box.min - slack)))
        return true;
    // Distances of the box from the faces, inwards, in the frame of the camera.
    const glm::dquat cameraFromWorld = glm::conjugate(camera.orientation);
    std::array<double, 6> inside;
    inside.fill(-std::numeric_limits<double>::infinity());
    for (int i = 0; i < 8; ++i) {
        const glm::dvec3 corner(i & 1 ? box.max.x : box.min.x, i & 2 ? box.max.y : box.min.y,
                                i & 4 ? box.max.z : box.min.z);
        const glm::dvec3 p = cameraFromWorld * (corner - camera.position);
        inside[0] = std::max(inside[0], -p.z - nearest);
        inside[1] = std::max(inside[1], farthest + p.z);
        // A face at the side goes through the viewpoint, or along the axis.
        const auto side = [&](double at, double slope, double sign) {
            return camera.orthographic ? sign * (at - slope)
                                       : sign * (at + slope * p.z) / std::hypot(1.0, slope);
        };
        const double left = -camera.cx / camera.fx;
        const double right = (camera.width - camera.cx) / camera.fx;
        const double up = camera.cy / camera.fy, down = (camera.cy - camera.height) / camera.fy;
        inside[2] = std::max(inside[2], side(p.x, left, 1));
        inside[3] = std::max(inside[3], side(p.x, right, -1));
        inside[4] = std::max(inside[4], side(p.y, up, -1));
        inside[5] = std::max(inside[5], side(p.y, down, 1));
    }
    return std::ranges::any_of(inside, [slack](double d) { return d < -slack; });
}

}  // namespace stx
