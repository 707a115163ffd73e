#pragma once

#include <span>

#include "lib/render/surface/noisy_views.hpp"

namespace stx::surface {

/// Alpha is exact where depth is noisy: moves points that other views see background at along their
/// rays, to the nearest place within their doubt where the fewest do (the visual hull: Laurentini
/// 1994). Points of no doubt stay. The same on any number of threads.
void keepInSilhouettes(std::span<const NoisyView> views);

}  // namespace stx::surface
