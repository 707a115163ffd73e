#pragma once

#include <map>
#include <memory>
#include <mutex>

#include "formats/mpeg4/scene/document.hpp"
#include "formats/video/video_picture.hpp"

namespace stx::mpeg4 {

/// Pictures of streams that only a video decoder reads (H.264, HEVC, MPEG-4 Visual, MPEG-2). Each
/// stream has a decoder of its own while it is used, up to a number of them. Safe from several
/// threads.
class StreamVideo {
  public:
    StreamVideo();
    ~StreamVideo();

    /// The picture of a sample. The stream must stay where it is. Errors: (unsupported) another
    /// coding, the module of video is not here; damage; memory over the limits.
    [[nodiscard]] Result<VideoPicture> picture(const ElementaryStream& stream, std::size_t sample,
                                               const Limits& limits);

  private:
    struct Decoder;
    [[nodiscard]] Result<std::shared_ptr<Decoder>> decoderOf(const ElementaryStream& stream,
                                                             const Limits& limits);
    /// Ends a decoder where there are as many as may be.
    void endOne();

    std::mutex mutex_;
    /// Of each stream that was asked for; null: it has ended.
    std::map<const ElementaryStream*, std::shared_ptr<Decoder>> decoders_;
    std::uint64_t uses_ = 0;
};

}  // namespace stx::mpeg4
