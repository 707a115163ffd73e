#pragma once

#include <memory>
#include <string>

#include "formats/decoders/decoder_process.hpp"
#include "formats/video/wire.hpp"

namespace stx {

/// The process in which libavformat and libavcodec work: video is the largest surface of attack
/// that there is, and its decoders are known to crash. It has no other open file than the one that
/// it reads, bounded memory, and dies with this object. One request at a time.
class VideoProcess {
  public:
    /// `file`: what it reads by itself, open; none where access units are sent. Errors as
    /// DecoderProcess::start().
    [[nodiscard]] static Result<std::unique_ptr<VideoProcess>> start(const Limits& limits,
                                                                     int file = -1);

    /// Asks, and waits for the answer. Errors: those of the libraries, in a sentence;
    /// (invalidInput) the process died, or kept busy for half a minute.
    [[nodiscard]] Result<Bytes> ask(video::Tag request, ByteSpan bytes, video::Tag expected);

    /// "libavformat 59.27.100, libavcodec 59.37.100".
    [[nodiscard]] const std::string& libraries() const { return process_->libraries(); }

  private:
    VideoProcess() = default;

    std::unique_ptr<DecoderProcess> process_;
    std::uint64_t most_ = 0;  ///< bytes of an answer
};

}  // namespace stx
