#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

#include "lib/base/job.hpp"

namespace stx::imagesets {

/// A pose of a trajectory: camera to world, y down, z forward.
struct TimedPose {
    double time = 0;  ///< seconds, or a frame's number; the line's, when the file has neither
    glm::dvec3 position{0.0};
    glm::dquat orientation{1, 0, 0, 0};
    bool lost = false;   ///< tracking was: there is a time only
    bool timed = false;  ///< its line begins with a time or a number
};

/// Lines `t tx ty tz qx qy qz qw`, or without t. Those with nan, inf or a quaternion of 0 are lost.
/// Errors name the line.
[[nodiscard]] Result<std::vector<TimedPose>> parseTrajectory(std::string_view text);

/// The pose at a time: between its neighbours when both are within `gap`, else the nearest within
/// `gap`; nothing when there is none. `poses` are in order of time,
/// and none is lost.
[[nodiscard]] std::optional<TimedPose> poseAt(const std::vector<TimedPose>& poses, double time,
                                              double gap);

}  // namespace stx::imagesets
