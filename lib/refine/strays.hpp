#pragma once

#include <cstdint>
#include <span>

#include "lib/refine/noisy_views.hpp"

namespace stx {

/// Points that too few of those around them are on one surface with become unknown: at rims a plane
/// has too few points to be fitted to, and their noise stays. Points that no other view shows or
/// sees past stay: nothing else may be there. Gives how many. The same on any number of threads.
std::int64_t removeStrays(std::span<const NoisyView> views);

}  // namespace stx
