#pragma once

#include <span>

#include "formats/video/ffmpeg/av.hpp"
#include "formats/video/wire.hpp"

namespace stx::video {

/// An H.264 encoder on one thread, without pictures that depend on later ones: access units come in
/// the order in which they are shown. The same pictures give the same bytes.
class Encoder {
  public:
    explicit Encoder(const EncoderRequest& request);
    /// AVCDecoderConfigurationRecord's parameter sets as libavcodec gives them (Annex B).
    [[nodiscard]] std::span<const std::byte> configuration() const;
    /// Takes a picture: planes without gaps. The access units that come out are added, packed.
    void encode(std::int64_t time, std::span<const std::byte> planes, Packer& units);
    void finish(Packer& units);

  private:
    void drain(Packer& units);

    EncoderRequest request_;
    CodecPtr codec_;
};

}  // namespace stx::video
