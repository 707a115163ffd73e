#pragma once

#include <span>
#include <vector>

#include "lib/base/image.hpp"
#include "lib/model/texture.hpp"

namespace stx {

/// A picture of the same size, taken from beside: what is at x here with a disparity of d is at
/// x - steps * d there.
struct SidePicture {
    Texture texture;
    double steps = 0;
};

/// How far beside each other a picture with disparities and others of its rectified set lie.
struct PictureShift {
    double disparity = 0;      ///< what is added to all disparities, pixels
    std::vector<double> down;  ///< how much lower each of the others shows the same, pixels
};

/// Finds the shift with which textures inside surfaces lie where `beside` show them; disparities
/// are off by -most to most. Disparities stored in whole numbers may have been cut off instead of
/// rounded, and rectified cameras are off by parts of a pixel, along rows and across. 0 where the
/// pictures do not tell clearly. `disparities`: pixels, kNoDepth = unknown, without stairs;
/// `texture` has the same size. The same on any number of threads.
[[nodiscard]] PictureShift pictureShift(const Image<float>& disparities, const Texture& texture,
                                        std::span<const SidePicture> beside, double most);

}  // namespace stx
