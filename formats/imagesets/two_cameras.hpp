#pragma once

#include <optional>
#include <string>

#include <glm/glm.hpp>

#include "formats/imagesets/image_sets.hpp"
#include "formats/imagesets/poses.hpp"

/// Recordings whose colour and depth come from two cameras, as a Kinect's.
namespace stx::imagesets {

/// A camera of depth beside one of colour.
struct DepthCamera {
    double fx = 0, fy = 0, cx = 0, cy = 0;  ///< as VisionCamera
    /// A point of the depth camera is turn * p + shift in the colour camera; both x right, y down,
    /// z forward.
    glm::dmat3 turn{1.0};
    glm::dvec3 shift{0.0};
};

/// The camera that took the depth, by ImageSetOptions::depthIntrinsics and depthToColour; nothing:
/// depth lies on the pixels of its picture. What the options do not give is as in `known`, which is
/// all where they give nothing and `byDefault`. Errors, from `where`: (usage) numbers that cannot
/// be a camera's, options that contradict each other; (io, invalidInput) the file of the motion.
[[nodiscard]] Result<std::optional<DepthCamera>> depthCameraOf(const ImageSetOptions& options,
                                                               const DepthCamera& known,
                                                               bool byDefault,
                                                               const std::string& where, Job& job);

/// The pose and intrinsics of that camera in our axes, without a size.
[[nodiscard]] Camera cameraBeside(const VisionCamera& colour, const DepthCamera& depth);

}  // namespace stx::imagesets
