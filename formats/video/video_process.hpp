#pragma once

#include <memory>

#include "formats/files/child_process.hpp"
#include "formats/files/files.hpp"
#include "formats/video/wire.hpp"

namespace stx {

/// The process in which libavformat and libavcodec work: video is the largest surface of attack
/// that there is, and its decoders are known to crash. It has no other open file than the one that
/// it reads, bounded memory, and dies with this object. One request at a time.
class VideoProcess {
  public:
    /// `file`: what it reads by itself; none where access units are sent. Errors: (unsupported) the
    /// module is not here; (failed) no process.
    [[nodiscard]] static Result<std::unique_ptr<VideoProcess>> start(const Limits& limits,
                                                                     Descriptor file = {});

    /// Asks, and waits for the answer. Errors: those of the libraries, in a sentence;
    /// (invalidInput) the process died, or kept busy for half a minute.
    [[nodiscard]] Result<Bytes> ask(video::Tag request, ByteSpan bytes, video::Tag expected);

  private:
    VideoProcess() = default;

    std::unique_ptr<ChildProcess> child_;
    std::uint64_t most_ = 0;  ///< bytes of an answer
    bool broken_ = false;
};

}  // namespace stx
