#pragma once

#include "lib/base/image.hpp"
#include "lib/model/texture.hpp"

namespace stx {

/// Distances on the finer grid of their picture, of the same shape. Between samples of one surface
/// 1/z is interpolated. At an edge each pixel goes to one of the surfaces around it, the one whose
/// samples are near and have its colour, so that the edge lies where the picture has it and no
/// point appears between two surfaces. kNoDepth is one of the surfaces. `coarse`: the picture in
/// the size of the depth, what each of its samples looks like. The same on any number of threads.
[[nodiscard]] Image<float> raiseDepth(const Image<float>& depth, const Texture& picture,
                                      const Texture& coarse);

}  // namespace stx
