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

/// The backgrounds of all still cameras of a sequence, one for each, in the order of the views:
/// views of their own, named after the camera's view. Frames are read one after another, the whole
/// sequence as often as the memory allowed makes it necessary (TemporalBackground). `times`:
/// seconds, rising, one for each frame. Cameras that move get none, with a note; so do those whose
/// background was never seen. Errors: no frames, a sequence whose views change, what reading gives.
[[nodiscard]] Result<std::vector<BackgroundModel>> rememberBackgrounds(
    std::span<const double> times, const FrameReader& read,
    const TemporalBackgroundSettings& settings, Job& job);

/// The frames with one more view for each background, the same in all frames. Backgrounds that
/// they had are left out.
[[nodiscard]] std::unique_ptr<Sequence> withBackgrounds(std::unique_ptr<Sequence> frames,
                                                        std::vector<BackgroundModel> backgrounds);

}  // namespace stx
