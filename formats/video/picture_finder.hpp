#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "formats/video/video_picture.hpp"
#include "formats/video/video_process.hpp"

namespace stx {

/// An access unit of a video stream, in the order of decoding.
struct CodedPicture {
    std::int64_t time = 0;  ///< when it is shown, ticks
    bool sync = false;      ///< decoding can begin here
};

/// Any picture of a stream: decodes from the last place before it at which that can begin, or goes
/// on from where it is.
class PictureFinder {
  public:
    /// How a stream is fed to the process.
    struct Source {
        /// The next access unit is number `unit`; the decoder has forgotten the others.
        std::function<Result<void>(std::size_t unit)> begin;
        /// Feeds number `unit`, or after the last tells that nothing comes; gives the answer
        /// (Tag::ready). `wanted`: the time of the picture that is looked for.
        std::function<Result<Bytes>(std::size_t unit, std::int64_t wanted)> feed;
    };

    /// `units` must outlive this.
    PictureFinder(VideoProcess& process, std::span<const CodedPicture> units, Source source)
        : process_(process), units_(units), source_(std::move(source)) {}

    /// The picture of an access unit. Errors: damage, memory over the limits.
    [[nodiscard]] Result<VideoPicture> find(std::size_t unit, const Limits& limits);

  private:
    /// The last place to begin from for a picture, at most `from`.
    [[nodiscard]] std::size_t syncBefore(std::size_t unit, std::size_t from) const;
    [[nodiscard]] bool isReady(std::int64_t time) const;
    [[nodiscard]] Result<void> feedUntil(std::int64_t time);

    VideoProcess& process_;
    std::span<const CodedPicture> units_;
    Source source_;
    std::optional<std::size_t> next_;  ///< the unit that is fed next; nothing: begin anew
    bool ended_ = false;
    std::vector<std::int64_t> ready_;  ///< times of pictures that can be taken
};

}  // namespace stx
