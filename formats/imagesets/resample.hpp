#pragma once

#include <utility>

#include "formats/imagesets/lens.hpp"
#include "formats/imagesets/panorama.hpp"
#include "lib/base/image.hpp"
#include "lib/model/texture.hpp"

/// Pictures with depth on another grid. Colour is interpolated (Catmull-Rom, or the mean of the
/// covered area when it shrinks); depth only between samples of one surface (1/z is linear on
/// planes), else the nearest sample is taken, so that no point appears between two surfaces.
namespace stx::imagesets {

using TextureAndDepth = std::pair<Texture, Image<float>>;

[[nodiscard]] Texture resizeTexture(const Texture& texture, int width, int height);

/// A part of the picture that an ideal pinhole would have taken: `camera` without the lens. What
/// the real picture does not show is transparent and has no depth; see Lens::shownPart().
[[nodiscard]] TextureAndDepth undistort(const Texture& texture, const Image<float>& depth,
                                        const Camera& camera, const Lens& lens,
                                        const PixelRectangle& part);

/// A cube face of a panorama whose depth is ray length; the face's depth is planar. `pose` is the
/// panorama's camera.
[[nodiscard]] TextureAndDepth faceOfPanorama(const Texture& texture, const Image<float>& rayLength,
                                             const Camera& face, const Camera& pose,
                                             const Panorama& panorama);

}  // namespace stx::imagesets
