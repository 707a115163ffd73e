#pragma once

#include <string_view>
#include <vector>

#include <glm/glm.hpp>

#include "lib/base/job.hpp"

/// Calibration of the MSR 3D Video sets (Breakdancers, Ballet).
namespace stx::imagesets {

/// One camera as the file has it: u = (fx X + skew Y)/Z + cx, v = fy Y/Z + cy of a point in camera
/// space, v counted upward from the bottom row; camera from world.
struct MsrCamera {
    int index = 0;
    double fx = 1, fy = 1, skew = 0, cx = 0, cy = 0;
    double k1 = 0, k2 = 0;
    glm::dmat3 rotation{1.0};  ///< as read: only nearly orthonormal
    glm::dvec3 translation{0.0};
};

/// Errors name the line, and the camera that is cut short.
[[nodiscard]] Result<std::vector<MsrCamera>> parseMsrCalibration(std::string_view text,
                                                                 const Limits& limits);

/// The world's Z of a stored value 0..255; 0 is the far end and valid.
[[nodiscard]] double msrWorldZ(double d, double minZ, double maxZ);

}  // namespace stx::imagesets
