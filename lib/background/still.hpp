#pragma once

#include "lib/background/still_frames.hpp"

/// Backgrounds out of plain video: README.md here, "from plain video".
namespace stx {

/// How a background is made from the frames of a camera that stands still.
enum class StillMethod {
    /// Of each pixel the frames in which least moves around it, and their median. After LaBGen-P.
    select,
    /// Updated frame by frame by the stability of its nearest-neighbour pixel gradient. After Zhao,
    /// Lu, Han 2016, whose abstract gives the steps; the formulas are ours.
    n2pg,
    /// The median of all frames.
    median,
};

struct StillSettings {
    StillMethod method = StillMethod::select;
    /// Frames to look at, spread evenly; 0: all of them. Else at least 2.
    int frames = 0;

    // ---- select ----

    int quietest = 19;  ///< frames that are kept of each pixel, 1..255
    /// The side of the window that motion is summed over: the picture's shorter side over this.
    int windowDivisor = 6;
    /// Frames with at most this many times the quietest ones' mean motion, or that of the film's
    /// middle pixel, are kept, too: where nothing happens the median is one of all frames, and an
    /// even thing that passes is not chosen for having less noise than what it hides. Below 1: few
    /// or none.
    double adaptive = 1.15;
    /// Motion is the change of gradients instead of luma: slow changes of light are none.
    bool drift = false;
};

struct StillBackground {
    Rgba8Image colour;  ///< opaque; 0 where no frame shows anything
    /// How far the frames that a pixel is made of agree with it, 0..255. select and median: the
    /// share of them within kStillAgrees levels in the worst channel; n2pg: the share of all frames
    /// that the pixel has been steady for since it was last replaced.
    Image<std::uint8_t> confidence;
    /// Frames that were looked at, without the damaged ones, in whose place another is shown.
    int framesUsed = 0;
};

/// Levels of 255 that a colour may be off and still agree with another.
inline constexpr int kStillAgrees = 20;

/// The background of the frames. The same result on any number of threads. Memory is bounded by
/// job.limits, whatever the number of frames: select and median work on bands of rows and read the
/// frames again for each when they cannot be kept (n2pg: once, with 24 bytes a pixel beside the
/// reader's frames). Pixels of a frame that are transparent (isSeen()) do not count. Errors: usage
/// (settings out of range; n2pg: transparent pixels), invalidInput (fewer than 2 frames), those of
/// reading a frame, failed (memory, cancelled).
[[nodiscard]] Result<StillBackground> stillBackground(StillFrames& frames,
                                                      const StillSettings& settings, Job& job);

/// What of a frame is not background: 255, else 0. A pixel is foreground when its largest
/// difference in a channel is beyond the frame's own noise (estimated from the quarter of its
/// pixels that differ least; kStillAgrees to 50 levels), or half of that and connected to enough
/// such pixels; specks are left out, and holes as small filled. Error (invalidInput): other size.
[[nodiscard]] Result<Image<std::uint8_t>> foregroundMask(const Rgba8Image& background,
                                                         const Rgba8Image& frame);

}  // namespace stx
