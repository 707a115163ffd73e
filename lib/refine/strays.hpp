#pragma once

#include <cstdint>
#include <span>

#include "lib/refine/noisy_views.hpp"

namespace stx {

/// Points that too few of those around them are on one surface with become unknown: at rims a plane
/// has too few points to be fitted to, and their noise stays. Points that no other view sees past
/// stay: they may be the outermost of the object. Gives how many. What is found of each view is in
/// `spool`, if any. The same on any number of threads.
std::int64_t removeStrays(std::span<const NoisyView> views, PixelSpool* spool = nullptr);

}  // namespace stx
