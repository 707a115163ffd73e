#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "lib/background/still_frames.hpp"

namespace stx {

/// Frames of plain video out of files.
class VideoFrames : public StillFrames {
  public:
    /// What to call frame k in the names of files that are made from it: the name of its own file
    /// without the ending, or that of its video with `_0007`.
    [[nodiscard]] virtual std::string name(int k) const = 0;
    /// Where frame k is, for messages: "'hall/in000007.png'", "'film.mp4': frame 7".
    [[nodiscard]] virtual std::string place(int k) const = 0;
    /// What all frames came from, for messages: "hall (99 pictures)".
    [[nodiscard]] virtual std::string description() const = 0;
};

/// Opens what `inputs` name: pictures, one after the other; or one of: a folder of numbered
/// pictures, a sequence `frame_%04d.png`, a picture, a `.y4m` file, a film (.mp4, .mov, .mkv,
/// .webm, .avi). The size is that of the first frame; no other frame is read yet. Errors: io,
/// invalidInput, and (unsupported) compressed video where the module of video is not, with how to
/// take the frames out of it. `job` must outlive the frames. A frame that is damaged is the one
/// before it that is not, or the one after, and a note counts them when the frames are destroyed;
/// an error when `strict`, when all are, and of frames of another size. What the frames that were
/// read lose as 8-bit sRGB is a note then, too.
[[nodiscard]] Result<std::unique_ptr<VideoFrames>> openVideoFrames(
    const std::vector<std::filesystem::path>& inputs, Job& job, bool strict = false);

}  // namespace stx
