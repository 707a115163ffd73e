#pragma once

#include <span>

#include "lib/base/image.hpp"
#include "lib/render/frame.hpp"
#include "lib/render/surface/cpu/fuse.hpp"

namespace stx::surface {

/// A frame before its holes are filled.
struct OpenFrame {
    Image<glm::vec4>& albedo;  ///< premultiplied; alpha below 1 is open
    Image<float>& q;           ///< of the main surface of each pixel, 0 = none
    const PixelSpace& space;
};

/// Fills small holes that no source looks into: where most directions meet surface nearby and a
/// stretch of the ray is hidden from every source. Gaps that a source sees through stay open.
void fillUnseen(OpenFrame frame, std::span<const LocalSource> sources);

/// Fills everything that is open from the background around it: for scenes that fill the frame.
/// Near surface along rays through the picture, beyond from a picture of half the size that was
/// filled before, so that the time grows with the pixels however large the openings are. Without
/// any surface nothing is filled.
void fillBackground(OpenFrame frame);

}  // namespace stx::surface
