#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/video/picture_finder.hpp"
#include "formats/video/video_picture.hpp"
#include "formats/video/video_process.hpp"

namespace stx {

/// What libavformat calls the container that first bytes (16 will do) begin: "matroska", "mov" or
/// "avi"; empty for others, of which a HEIC picture is one.
[[nodiscard]] std::string_view filmFormatOf(ByteSpan head);
/// The same of a file; empty for what is not a regular file, too.
[[nodiscard]] std::string_view filmFormatOf(const std::filesystem::path& path);

/// A file of compressed video, any picture of one of its tracks at random, in the memory of a few
/// pictures. What it is made of is known when it is opened; then the track is read through once for
/// where its pictures are, and none is decoded. Safe from several threads, which wait for each
/// other; ascending pictures are fastest.
class Film {
  public:
    struct Track {
        bool video = false;
        std::string codec;          ///< "h264", "ffv1", "rawvideo"
        std::string pixels;         ///< "yuv420p", "gray16be"
        int width = 0, height = 0;  ///< as it is shown, turned
        video::Turn turn;
        std::string title;
        std::string attachment;  ///< of a file in the film: its name
        Bytes attached;          ///< and what is in it
    };

    /// Errors, which name the file: io; invalidInput (damaged); (unsupported) another container, a
    /// codec that is not decoded, the module of video is not here.
    [[nodiscard]] static Result<std::unique_ptr<Film>> open(const std::filesystem::path& path,
                                                            const Limits& limits);

    [[nodiscard]] const std::vector<Track>& tracks() const { return tracks_; }
    /// The first track of video; -1: none.
    [[nodiscard]] int firstVideo() const;
    /// Chooses a track, before anything below. Where the container is damaged, so that pictures of
    /// it may be missing, there is a note. Errors as open(), and no picture in it; damage, too,
    /// when `strict`.
    [[nodiscard]] Result<void> select(int track, bool strict, Job& job);

    /// The track that select() chose.
    [[nodiscard]] const Track& chosen() const { return tracks_[static_cast<std::size_t>(track_)]; }
    /// Turns its pictures so, and not as its track says. After select().
    void turn(video::Turn how) { turn_ = how; }

    /// When its pictures are shown, seconds by the file's clock, ascending, each once.
    [[nodiscard]] const std::vector<double>& times() const { return times_; }
    /// How long the last one is shown, seconds; 0: not told.
    [[nodiscard]] double lastDuration() const { return lastDuration_; }
    [[nodiscard]] int count() const { return static_cast<int>(times_.size()); }
    [[nodiscard]] const std::filesystem::path& path() const { return path_; }

    /// Picture `k`, by the time that it is shown, turned as players do. Errors name the file, the
    /// picture and its time.
    [[nodiscard]] Result<VideoPicture> picture(int k);

  private:
    Film() = default;
    [[nodiscard]] Result<Bytes> ask(video::Tag request, const video::Packer& bytes,
                                    video::Tag expected);
    [[nodiscard]] std::string where() const { return fmt::format("'{}'", path_.string()); }

    struct Unit {
        std::int64_t dts = 0, pts = 0;
    };
    std::filesystem::path path_;
    Limits limits_;
    std::mutex mutex_;
    std::unique_ptr<VideoProcess> process_;
    std::vector<Track> tracks_;
    int track_ = 0;            ///< the chosen one
    video::Turn turn_;         ///< of the chosen track
    std::vector<Unit> units_;  ///< in the order of decoding
    std::vector<CodedPicture> coded_;
    std::vector<std::size_t> shown_;  ///< units in the order of times_
    std::vector<double> times_;
    double lastDuration_ = 0;
    std::optional<PictureFinder> finder_;
};

}  // namespace stx
