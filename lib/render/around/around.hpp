#pragma once

#include <array>
#include <vector>

#include "lib/base/job.hpp"
#include "lib/render/api/renderer.hpp"

namespace stx {

/// An equirectangular picture of all that is seen from a camera's place, in the camera's axes: -Z
/// in the middle, +X to the right of it, +Y on top, 360 by 180 degrees (latlongDirection()). Drawn
/// as six cube faces, which are those that a picture all around of this size becomes when it is
/// read as views (cubeFaces() of formats/imagesets), then resampled. Colour and albedo are
/// premultiplied, so alpha is coverage; depth is the length of the ray, not planar; normals are in
/// the world. Of the camera only position and orientation count. Errors (usage): a width that is
/// not twice the height, or below 4; those of the renderer.
[[nodiscard]] Result<Frame> renderAround(Renderer& renderer, const Camera& camera, int width,
                                         int height, Job& job);

/// The names of those faces, as views: front, left, back, right, up, down.
inline constexpr std::array kFacesAround = {"front", "left", "back", "right", "up", "down"};

/// Views that were taken from one place (a sensor that turned on a tripod) as the six faces of a
/// cube around it, seen from inside, in the world's axes: what several views show is merged, pixels
/// are as dense as the densest view's in its middle. Faces that show nothing are left out. Errors
/// (invalidInput): orthographic views; cameras that are further apart than a twentieth of the
/// distance of what they see (above a two-hundredth it is noted). `spool`, if any, is that of the
/// bundle; the faces are in memory.
[[nodiscard]] Result<Bundle> cubeFromInside(const Bundle& bundle, Job& job,
                                            PixelSpool* spool = nullptr);

/// The cameras of those six faces: front, left, back, right, up, down, each 90 degrees and a pixel
/// more on every side, with `half` pixels from the middle to 45 degrees.
[[nodiscard]] std::vector<Camera> facesAround(const Camera& pose, int half);
/// `half` of a picture all around: faces have as many pixels to the degree in their middle.
[[nodiscard]] int facesHalf(int width);

}  // namespace stx
