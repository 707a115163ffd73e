#pragma once

#include <span>

#include "lib/refine/noisy_views.hpp"

namespace stx {

/// Moves the points of each view along their rays to where the views around it show the same
/// surface: the mean of all that agree within their noise, each weighted by one over the variance
/// that it has along the ray. Surfaces seen from behind count only where a point lies on the wrong
/// side of them. What is left of the noise becomes less by that. New q of each view are in `spool`,
/// if any. The same on any number of threads.
void agreeOnDepth(std::span<NoisyView> views, PixelSpool* spool = nullptr);

}  // namespace stx
