#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <glm/glm.hpp>

#include "formats/imagesets/image_sets.hpp"
#include "formats/imagesets/poses.hpp"

/// Recordings whose colour and depth come from two cameras, as a Kinect's.
namespace stx::imagesets {

/// fx, fy, cx, cy in pixels of a picture, from its first pixel's centre.
using PixelIntrinsics = glm::dvec4;

/// The picture that the usual intrinsics of a Kinect are of.
inline constexpr glm::ivec2 kKinectSize{640, 480};

/// Intrinsics of pictures of the size `of` for pictures of another size: scaled where the shape is
/// the same, else as they are.
[[nodiscard]] PixelIntrinsics scaledTo(glm::ivec2 size, PixelIntrinsics k,
                                       glm::ivec2 of = kKinectSize);
/// The same of kKinectSize, with a note of where they come from ("TUM's freiburg1 published ones
/// are used"), and whether they can fit.
[[nodiscard]] PixelIntrinsics usualIntrinsics(std::string_view from, PixelIntrinsics ofKinect,
                                              glm::ivec2 size, Job& job);

/// ImageSetOptions::intrinsics; nothing where they are not given. Errors (usage): a focal length of
/// 0.
[[nodiscard]] Result<std::optional<PixelIntrinsics>> givenIntrinsics(
    const ImageSetOptions& options);
/// Notes a principal point that is outside the picture.
void noteOddCentre(const PixelIntrinsics& k, glm::ivec2 size, Job& job);

/// A camera of depth beside one of colour.
struct DepthCamera {
    double fx = 0, fy = 0, cx = 0, cy = 0;  ///< as VisionCamera
    /// A point of the depth camera is turn * p + shift in the colour camera; both x right, y down,
    /// z forward.
    glm::dmat3 turn{1.0};
    glm::dvec3 shift{0.0};
};

/// What is known of the camera of depth where options do not say it.
struct KnownDepthCamera {
    DepthCamera camera;
    bool intrinsics = false;  ///< else those of the colour camera
    bool pose = false;        ///< else that of the colour camera
    bool byDefault = false;   ///< it took the depth where no option says anything
};

/// The camera that took the depth, by ImageSetOptions::depthIntrinsics and depthToColour, else by
/// what is known; nothing: depth lies on the pixels of its picture. The sizes are those of the two
/// pictures. What is used and what is assumed is noted. Errors, from `where`: (usage) numbers that
/// cannot be a camera's, options that contradict each other, a pose of a camera whose intrinsics
/// nobody tells; (io, invalidInput) the file of the motion.
[[nodiscard]] Result<std::optional<DepthCamera>> depthCameraOf(const ImageSetOptions& options,
                                                               const KnownDepthCamera& known,
                                                               glm::ivec2 colourSize,
                                                               glm::ivec2 depthSize,
                                                               const std::string& where, Job& job);

/// The pose and intrinsics of that camera in our axes, without a size.
[[nodiscard]] Camera cameraBeside(const VisionCamera& colour, const DepthCamera& depth);

}  // namespace stx::imagesets
