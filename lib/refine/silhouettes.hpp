#pragma once

#include <span>

#include "lib/refine/noisy_views.hpp"

namespace stx {

/// Coverage, 0..1: rays pass where it is below `free`; what is `solid` or more is an object.
struct SilhouetteAlpha {
    float free, solid;
};

/// Alpha is exact where depth is noisy: moves points that other views see background at along their
/// rays, to the nearest place within their doubt where the fewest do (the visual hull: Laurentini
/// 1994). Of more than 64 other views those 64 are asked that look from the most different
/// directions: viewsAround(). Points of no doubt stay. New q of each view are in `spool`, if any.
/// The same on any number of threads.
void keepInSilhouettes(std::span<const NoisyView> views, const SilhouetteAlpha& alpha,
                       PixelSpool* spool = nullptr);

}  // namespace stx
