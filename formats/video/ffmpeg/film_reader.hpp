#pragma once

#include <optional>

#include "formats/video/ffmpeg/decoder.hpp"
#include "formats/video/wire.hpp"

namespace stx::video {

/// A file of video by its descriptor. Nothing else is opened, whatever the file asks for.
class FilmReader {
  public:
    /// `format`: libavformat's name of the only reader that is tried.
    FilmReader(int file, const std::string& format);
    FilmReader(const FilmReader&) = delete;
    FilmReader& operator=(const FilmReader&) = delete;

    /// Tracks and attachments, packed.
    [[nodiscard]] std::vector<std::byte> describe() const;
    /// Chooses a track, which is then read through once with readOn().
    void select(int track);
    /// The access units of the next part of the track, packed; after the last part the track is at
    /// its beginning again.
    [[nodiscard]] std::vector<std::byte> readOn();
    /// The next access unit that is fed is the one of these times, or the track's first.
    void seek(std::int64_t dts, std::int64_t pts);
    /// Feeds the next one; false at the end.
    bool step(std::int64_t wanted);
    [[nodiscard]] Decoder& decoder();

  private:
    /// The next access unit of the track; null at the end.
    [[nodiscard]] const AVPacket* next();
    void rewind();

    struct Source {
        int file = -1;
        std::int64_t at = 0, size = 0;
    } source_;
    IoPtr io_;  ///< after film_, which reads through it, it is closed
    FilmPtr film_;
    PacketPtr packet_;
    std::optional<Decoder> decoder_;
    int track_ = -1;
    std::uint64_t units_ = 0;  ///< that readOn() has told
    std::string damage_;       ///< of the container, as far as the track was read
    bool held_ = false;        ///< packet_ is still to be fed
    bool ended_ = false;
};

}  // namespace stx::video
