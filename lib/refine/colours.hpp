#pragma once

#include <span>

#include "lib/refine/noisy_views.hpp"

namespace stx {

/// Moves the points of each view along their rays, within their doubt, such that the views around
/// it show the same colours there (Lucas & Kanade 1981, along the lines that the points move on in
/// those views, for the points of a small window together). Only points that are far from what is
/// not their surface say anything. New q of each view are in `spool`, if any. The same on any
/// number of threads.
void agreeOnColours(std::span<const NoisyView> views, PixelSpool* spool = nullptr);

}  // namespace stx
