#pragma once

#include <span>

#include "lib/base/image.hpp"
#include "lib/model/texture.hpp"

namespace stx {

/// A picture of the same size, taken from beside: what is at x here with a disparity of d is at
/// x - steps * d there.
struct SidePicture {
    Texture texture;
    double steps = 0;
};

/// What is added to all disparities such that textures inside surfaces lie where `beside` show
/// them: pixels, from -most to most. Disparities stored in whole numbers may have been cut off
/// instead of rounded, and rectified cameras are off by parts of a pixel. 0 where the pictures do
/// not tell clearly. `disparities`: pixels, kNoDepth = unknown, without stairs; `texture` has the
/// same size. The same on any number of threads.
[[nodiscard]] double disparityShift(const Image<float>& disparities, const Texture& texture,
                                    std::span<const SidePicture> beside, double most);

}  // namespace stx
