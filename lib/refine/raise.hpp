#pragma once

#include "lib/base/image.hpp"
#include "lib/model/texture.hpp"

namespace stx {

/// Distances on the finer grid of their picture, of the same shape. Between samples of one surface
/// 1/z is interpolated. At an edge each pixel goes to one of the surfaces around it: one whose
/// samples are near and have its colour, together with the neighbours that look like it, so that
/// the edge lies where the picture has it and no point appears between two surfaces. kNoDepth is
/// one of the surfaces. The same on any number of threads.
[[nodiscard]] Image<float> raiseDepth(const Image<float>& depth, const Texture& picture,
                                      const Image<std::uint8_t>* matte = nullptr);

}  // namespace stx
