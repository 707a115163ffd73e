#pragma once

#include <cstdint>
#include <cstring>
#include <deque>
#include <span>
#include <vector>

#include "formats/video/ffmpeg/av.hpp"

namespace stx::video {

/// A video decoder on one thread, so that it gives the same on every machine, and the last pictures
/// that it gave.
class Decoder {
  public:
    /// Of a track of a film.
    explicit Decoder(const AVCodecParameters& track);
    /// Of a stream whose coding MPEG-4 names by its objectTypeIndication.
    Decoder(int objectTypeIndication, std::span<const std::byte> configuration);

    /// Feeds an access unit; null: nothing comes after. Of the pictures before `wanted` the last
    /// few are kept, and all after it (as many as the codec reorders).
    void push(const AVPacket* packet, std::int64_t wanted);
    void flush();
    /// Times of the pictures that are here, ascending.
    [[nodiscard]] std::vector<std::int64_t> times() const;
    /// Null when it is not here.
    [[nodiscard]] const AVFrame* find(std::int64_t time) const;
    [[nodiscard]] const AVCodecContext& codec() const { return *codec_; }

  private:
    void open(AVCodecID id, const AVCodecParameters* track,
              std::span<const std::byte> configuration);

    CodecPtr codec_;
    std::deque<FramePtr> ready_;
};

/// Names of the decoders that may run, with commas between.
[[nodiscard]] std::string allowedDecoders();

/// Packs the picture: planes of luma and chroma as they are where they are planes; RGBA else.
[[nodiscard]] std::vector<std::byte> packed(const AVFrame& frame, const AVCodecContext& codec);

}  // namespace stx::video
