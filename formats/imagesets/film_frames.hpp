#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "formats/imagesets/set_view.hpp"

namespace stx::imagesets {

/// A frame of a film of depth with the frame of colour of the same moment.
struct FramePair {
    int colour = 0, depth = 0;
    double time = 0;  ///< of the depth, seconds by the film's clock
};

/// Pairs by time: to each time of depth the nearest of colour, within half a frame of colour. Where
/// films have as many frames and their clocks do not agree, one by one, with a note; frames of
/// depth without colour and of colour without depth are left out, with a note. `where` is for
/// messages. Errors (invalidInput): no pair.
[[nodiscard]] Result<std::vector<FramePair>> pairFrames(const Film& colour, const Film& depth,
                                                        const std::string& where, Job& job);

/// The end of a set whose last picture is the last of these, where the film tells how long that is
/// shown.
void extendTo(std::optional<double>& end, const std::vector<FramePair>& frames, const Film& depth);

/// A picture of a film, to be read later.
[[nodiscard]] PictureSource frameOf(const std::shared_ptr<Film>& film, int frame);

}  // namespace stx::imagesets
