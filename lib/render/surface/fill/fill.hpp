#pragma once

#include <limits>
#include <span>

#include "lib/base/image.hpp"
#include "lib/render/api/frame.hpp"
#include "lib/render/surface/prepare/votes.hpp"

namespace stx::surface {

/// A frame before its holes are filled.
struct OpenFrame {
    Image<glm::vec4>& albedo;  ///< premultiplied; alpha below 1 is open
    Image<float>& q;           ///< of the main surface of each pixel, 0 = none
    const PixelSpace& space;
    Image<glm::vec3>* normal = nullptr;  ///< world, zero where unknown; null when not wanted
    /// Of all that may be seen, scene units: see fillUnseen().
    double radius = std::numeric_limits<double>::infinity();
};

/// Fills holes that no source looks into: where a stretch of the ray is hidden from every source,
/// and most directions meet surface nearby or the hole is at most `widest` pixels wide (0 = small
/// ones only). Gaps that a source sees through stay open. Depth and normal are those of the surface
/// that continues there: the planes of the surfaces around are followed into the hole, and the
/// nearest that no source sees past counts. Where all end, depth is where the hidden stretch
/// begins, and the normal stays as it is. How far around surfaces that is looked for grows with
/// their distance, up to that of an eye 16 times the radius away.
void fillUnseen(OpenFrame frame, std::span<const LocalSource> sources, int widest);

/// Fills what is open from the background around it: for scenes that fill the frame. Filled is what
/// a source looked at but something hid: where a ray, from the depth of the fill to twice that, is
/// in its frustum, before its far plane, and no source sees past it; with a border of a twentieth
/// of its picture. The rest stays open: the sky above a street is not filled because some source
/// has a house before it. Near surface along rays through the picture, beyond from a
/// picture of half the size that was filled before, so that the time grows with the pixels however
/// large the openings are. Without any surface nothing is filled. Of frames that are averaged by
/// `averagedBy` along each side afterwards, which must divide their sizes, the average is filled.
void fillBackground(OpenFrame frame, std::span<const LocalSource> sources, int averagedBy = 1);

}  // namespace stx::surface
