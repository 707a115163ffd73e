#pragma once

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "lib/background/temporal.hpp"
#include "lib/model/sequence.hpp"

namespace stx {

/// Gives the bundle of one moment, by its number; all have the same views in the same order.
using FrameReader = std::function<Result<Bundle>(std::size_t frame, Job& job)>;

/// The backgrounds of a sequence, as views of their own: one for each still camera, in the order of
/// the views and named after them, then those of all cameras that move, in a few poses of their
/// paths (temporal::rememberMovingCameras()). Frames are read one after another, the whole
/// sequence as often as the memory allowed makes it necessary (TemporalBackground). `times`:
/// seconds, rising, one for each frame. Cameras whose background was never seen get none, with a
/// note. Where some colours are 8-bit sRGB and others linear, all become linear light. Errors: no
/// frames, a sequence whose views change, what reading gives.
[[nodiscard]] Result<std::vector<BackgroundModel>> rememberBackgrounds(
    std::span<const double> times, const FrameReader& read,
    const TemporalBackgroundSettings& settings, Job& job);

/// The frames with one more view for each background, the same in all frames. Backgrounds that
/// they had are left out. With linear backgrounds all views become linear, as those of a bundle
/// are of one kind.
[[nodiscard]] std::unique_ptr<Sequence> withBackgrounds(std::unique_ptr<Sequence> frames,
                                                        std::vector<BackgroundModel> backgrounds);

}  // namespace stx
