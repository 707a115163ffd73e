#include "formats/imagesets/poses.hpp"

#include <algorithm>
#include <cmath>

#include "lib/base/counted.hpp"

namespace stx::imagesets {

Result<glm::dmat3> repairRotation(const glm::dmat3& matrix, double focalPixels,
                                  const std::string& where, Job& job) {
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            if (!std::isfinite(matrix[i][j]))
                return failAt(where, ErrorCode::invalidInput,
                              "the rotation has a value that is not finite");
    const double determinant = glm::determinant(matrix);
    if (!(std::abs(determinant) > 1e-6))
        return failAt(where, ErrorCode::invalidInput,
                      "the rotation is a singular matrix (determinant {:g}; 1 is expected)",
                      determinant);
    if (determinant < 0)
        return failAt(where, ErrorCode::invalidInput,
                      "the rotation mirrors (determinant {:g}; 1 is expected)", determinant);
    glm::dmat3 r = matrix;
    for (int i = 0; i < 40; ++i) {
        const glm::dmat3 next = (r + glm::transpose(glm::inverse(r))) * 0.5;
        double change = 0;
        for (int c = 0; c < 3; ++c) change = std::max(change, glm::length(next[c] - r[c]));
        r = next;
        if (change < 1e-16) break;
    }
    double error = 0;
    for (int c = 0; c < 3; ++c) error = std::max(error, glm::length(r[c] - matrix[c]));
    if (!(error < 0.05))
        return failAt(where, ErrorCode::invalidInput,
                      "the rotation scales or shears: a column is off by {:.3g} from the nearest "
                      "rotation; at most 0.05 is repaired",
                      error);
    if (error * focalPixels > 0.01)
        job.note(
            fmt::format("{}: the rotation is not quite orthonormal; repaired by up to {:.2g} "
                        "pixels",
                        where, error * focalPixels));
    return r;
}

Camera cameraFromVision(const VisionCamera& v) {
    // Our axes among the camera's: right, up, backward.
    const double right = v.fx < 0 ? -1 : 1, down = v.fy < 0 ? -1 : 1;
    glm::dmat3 worldFromOurs(v.worldFromCamera[0] * right, v.worldFromCamera[1] * -down,
                             -v.worldFromCamera[2]);
    Camera c;
    c.position = v.centre;
    if (v.leftHanded()) {
        for (int i = 0; i < 3; ++i) worldFromOurs[i].z = -worldFromOurs[i].z;
        c.position.z = -c.position.z;
    }
    c.orientation = glm::normalize(glm::quat_cast(worldFromOurs));
    c.width = v.width;
    c.height = v.height;
    c.fx = std::abs(v.fx);
    c.fy = std::abs(v.fy);
    c.cx = v.cx;
    c.cy = v.cy;
    return c;
}

bool isTracked(std::span<const double> pose) {
    return std::ranges::all_of(pose, [](double value) { return std::isfinite(value); });
}

Result<void> noteLost(std::size_t lost, std::size_t all, const std::string& where, bool strict,
                      Job& job) {
    if (lost == 0) return {};
    const std::string found =
        fmt::format("{} of {} {} of lost tracking (nan, inf or a rotation of zeros)", lost,
                    counted(all, "pose"), lost == 1 ? "is" : "are");
    if (strict || lost == all) return failAt(where, ErrorCode::invalidInput, "{}", found);
    job.note(fmt::format("{}: {} and {} left out", where, found, lost == 1 ? "is" : "are"));
    return {};
}

Result<glm::dmat3> rotationFromQuaternion(glm::dvec4 xyzw, const std::string& where) {
    const double length = glm::length(xyzw);
    if (!std::isfinite(length) || !(length > 1e-6))
        return failAt(where, ErrorCode::invalidInput,
                      "the quaternion has the length {:g}; 1 is expected", length);
    const glm::dvec4 q = xyzw / length;
    return glm::mat3_cast(glm::dquat(q.w, q.x, q.y, q.z));
}

}  // namespace stx::imagesets
