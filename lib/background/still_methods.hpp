#pragma once

#include <span>

#include "lib/background/still.hpp"

namespace stx {

/// What a pixel of `select` and `median` may take while it is worked on, beside the frames: most of
/// it are the counts of 3 x 256 values.
inline constexpr std::uint64_t kSelectBytesPerPixel = 1710;
/// The same of `n2pg`, with the frame that is being taken in.
inline constexpr std::uint64_t kN2pgBytesPerPixel = 24;

/// The methods of stillBackground(); `which` are the frames to look at, at least 2.
[[nodiscard]] Result<StillBackground> selectBackground(StillFrames& frames,
                                                       std::span<const int> which,
                                                       const StillSettings& settings, Job& job);
[[nodiscard]] Result<StillBackground> n2pgBackground(StillFrames& frames,
                                                     std::span<const int> which, Job& job);

/// Whether frame which[i] counts: it is not the picture of which[i - 1] once more, because it is
/// damaged. Both have been read.
[[nodiscard]] bool isSound(const StillFrames& frames, std::span<const int> which, std::size_t i);
/// How many do.
[[nodiscard]] int soundFrames(const StillFrames& frames, std::span<const int> which);

}  // namespace stx
