#pragma once

#include "lib/base/image.hpp"
#include "lib/model/texture.hpp"

namespace stx {

/// Of the step `raise`: small parts of depth that are joined to nothing around them (of the soft
/// edges of phones' depth maps, where many samples lie between two surfaces) get the distance of
/// the larger part beside them that looks most alike. `depth`: scene units, on the picture's grid;
/// `sample`: pixels of the picture for each sample of the coarse depth.
void joinSpecks(Image<float>& depth, const Texture& picture, double sample);

}  // namespace stx
