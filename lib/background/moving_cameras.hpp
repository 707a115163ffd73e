#pragma once

#include <span>
#include <vector>

#include "lib/background/sequence_background.hpp"

namespace stx::temporal {

/// The background that cameras see on their way: key views, which are a few poses of their paths,
/// chosen so that together they see what all frames see; into each all frames are fused
/// (KeyBackground). `views`: numbers of the cameras that move, which see one world together.
/// Poses that disagree by half a pixel or more are registered first, over what stands still
/// (refinePoses): key views with each other, each frame with the key view it shares most with.
/// Frames are read three times, more often when not all key views fit into the memory allowed.
/// Errors: orthographic cameras, frames that change their size or kind of colour, one key view that
/// does not fit into memory, what reading gives.
[[nodiscard]] Result<std::vector<BackgroundModel>> rememberMovingCameras(
    std::span<const double> times, const FrameReader& read, std::span<const std::size_t> views,
    const TemporalBackgroundSettings& settings, Job& job);

}  // namespace stx::temporal
