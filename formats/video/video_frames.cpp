#include "formats/video/video_frames.hpp"

#include <algorithm>
#include <atomic>
#include <fstream>
#include <map>
#include <mutex>

#include "formats/files/messages.hpp"
#include "formats/files/named_files.hpp"
#include "formats/files/not_there.hpp"
#include "formats/images/images.hpp"
#include "formats/images/more_pictures.hpp"
#include "formats/photos/file_colours.hpp"
#include "formats/video/film.hpp"
#include "formats/video/numbered_pictures.hpp"
#include "formats/yuv/y4m_reader.hpp"
#include "lib/base/counted.hpp"
#include "lib/model/sequence.hpp"

namespace stx {
namespace {

namespace fs = std::filesystem;

class PictureFrames final : public VideoFrames {
  public:
    PictureFrames(std::vector<fs::path> files, std::string what, Job& job)
        : files_(std::move(files)), what_(std::move(what)), job_(job), loss_(job) {}

    /// Takes the size from the first picture that can be read; not further on when `strict`.
    Result<void> open(bool strict) {
        auto picture = read(0);
        for (std::size_t k = 1; !picture && !strict && isDamage(picture.error()); ++k) {
            if (k == files_.size()) break;
            if (auto later = read(k)) picture = std::move(later);
        }
        if (!picture) return propagate(picture);
        size_ = picture->size();
        return {};
    }
    [[nodiscard]] glm::ivec2 size() const override { return size_; }
    [[nodiscard]] int count() const override { return static_cast<int>(files_.size()); }
    [[nodiscard]] Result<std::shared_ptr<const Rgba8Image>> frame(int k) override {
        STX_TRY(auto picture, read(static_cast<std::size_t>(k)));
        return std::make_shared<const Rgba8Image>(std::move(picture));
    }
    [[nodiscard]] std::string name(int k) const override { return files_[k].stem().string(); }
    [[nodiscard]] std::string place(int k) const override { return inQuotes(files_[k].string()); }
    [[nodiscard]] std::string description() const override {
        return fmt::format("{} ({})", what_, counted(files_.size(), "picture"));
    }

  private:
    [[nodiscard]] Result<Rgba8Image> read(std::size_t k) {
        const auto& file = files_[k];
        STX_TRY(const auto bytes, readFile(file, job_.limits));
        noteMorePictures(bytes, file.string(), job_);
        Rgba8Loss loss;
        std::string colours;
        STX_TRY(auto picture,
                photos::decodeAsShown(bytes, file.string(), job_.limits, colours, &loss));
        loss_.add(loss);
        // Each frame is read several times.
        if (!colours.empty()) job_.noteOnce(colours);
        return picture;
    }

    std::vector<fs::path> files_;
    std::string what_;
    Job& job_;
    SharedRgba8Loss loss_;
    glm::ivec2 size_{0};
};

class Y4mFrames final : public VideoFrames {
  public:
    Y4mFrames(Y4mReader reader, fs::path file, Job& job)
        : reader_(std::move(reader)), file_(std::move(file)), job_(job), loss_(job) {
        loss_.add({.bits = reader_.bits()});
    }

    [[nodiscard]] glm::ivec2 size() const override { return {reader_.width(), reader_.height()}; }
    [[nodiscard]] int count() const override { return reader_.count(); }
    [[nodiscard]] Result<std::shared_ptr<const Rgba8Image>> frame(int k) override {
        STX_TRY(auto picture, within(inQuotes(file_.string()), reader_.frame(k, job_.limits)));
        return std::make_shared<const Rgba8Image>(std::move(picture));
    }
    [[nodiscard]] std::string name(int k) const override {
        return fmt::format("{}_{:04}", file_.stem().string(), k);
    }
    [[nodiscard]] std::string place(int k) const override {
        return fmt::format("{}: frame {}", inQuotes(file_.string()), k);
    }
    [[nodiscard]] std::string description() const override {
        return fmt::format("{} ({})", file_.filename().string(), counted(count(), "frame"));
    }

  private:
    Y4mReader reader_;
    fs::path file_;
    Job& job_;
    SharedRgba8Loss loss_;
};

class FilmFrames final : public VideoFrames {
  public:
    FilmFrames(std::unique_ptr<Film> film, int track, Job& job)
        : film_(std::move(film)), job_(job), loss_(job) {
        const Film::Track& of = film_->tracks()[track];
        size_ = {of.width, of.height};
    }

    [[nodiscard]] glm::ivec2 size() const override { return size_; }
    [[nodiscard]] int count() const override { return film_->count(); }
    [[nodiscard]] Result<std::shared_ptr<const Rgba8Image>> frame(int k) override {
        STX_TRY(const auto picture, film_->picture(k));
        noteOfColours(picture);
        loss_.add({.bits = picture.bits()});
        STX_TRY(auto colour, within(place(k), picture.colour(job_.limits)));
        return std::make_shared<const Rgba8Image>(std::move(colour));
    }
    [[nodiscard]] std::string name(int k) const override {
        return fmt::format("{}_{:04}", film_->path().stem().string(), k);
    }
    [[nodiscard]] std::string place(int k) const override {
        return fmt::format("{}: frame {}", inQuotes(film_->path().string()), k);
    }
    [[nodiscard]] std::string description() const override {
        return fmt::format("{} ({})", film_->path().filename().string(), counted(count(), "frame"));
    }

  private:
    /// Once of a film, not of each frame.
    void noteOfColours(const VideoPicture& picture) {
        const std::string note = picture.notConverted();
        if (!note.empty() && !noted_.exchange(true))
            job_.note(inQuotes(film_->path().filename().string()) + ": " + note +
                      VideoPicture::kConvertFirst);
    }

    std::unique_ptr<Film> film_;
    Job& job_;
    SharedRgba8Loss loss_;
    std::atomic<bool> noted_ = false;
    glm::ivec2 size_{0};
};

/// Frames of one size, gone on with where some are damaged.
class SteadyFrames final : public VideoFrames {
  public:
    SteadyFrames(std::unique_ptr<VideoFrames> frames, bool strict, Job& job)
        : frames_(std::move(frames)), strict_(strict), job_(job) {}
    ~SteadyFrames() override {
        const auto wanted = [](const auto& entry) { return entry.second.wanted; };
        const auto first = std::ranges::find_if(damaged_, wanted);
        if (first == damaged_.end()) return;
        job_.note(
            fmt::format("{} of {} cannot be used, and the frame before takes its place; stx "
                        "background --strict stops there; the first: {}",
                        std::ranges::count_if(damaged_, wanted), counted(count(), "frame"),
                        first->second.error.text()));
    }
    SteadyFrames(const SteadyFrames&) = delete;
    SteadyFrames& operator=(const SteadyFrames&) = delete;

    [[nodiscard]] glm::ivec2 size() const override { return frames_->size(); }
    [[nodiscard]] int count() const override { return frames_->count(); }
    [[nodiscard]] Result<std::shared_ptr<const Rgba8Image>> frame(int k) override {
        auto picture = frames_->frame(knownFor(k));
        if (!picture && !strict_ && isDamage(picture.error()))
            if (const int other = findFor(k, picture.error()); other != k)
                picture = frames_->frame(other);
        if (!picture) return picture;
        const auto found = (*picture)->size(), wanted = size();
        if (found != wanted)
            return failAt(
                place(k), ErrorCode::invalidInput,
                "it is {}x{}, but the first frame, {}, is {}x{}; all frames must have one "
                "size",
                found.x, found.y, place(0), wanted.x, wanted.y);
        return picture;
    }
    [[nodiscard]] int shownFor(int k) const override {
        const std::lock_guard lock(mutex_);
        const auto known = damaged_.find(k);
        return known == damaged_.end() ? k : known->second.shown;
    }
    [[nodiscard]] std::string name(int k) const override { return frames_->name(k); }
    [[nodiscard]] std::string place(int k) const override { return frames_->place(k); }
    [[nodiscard]] std::string description() const override { return frames_->description(); }

  private:
    struct Damage {
        Error error;
        int shown;            ///< the frame that takes its place; itself where there is none
        bool wanted = false;  ///< and not only found on the way to another
    };

    /// shownFor() a frame that is being read.
    int knownFor(int k) {
        const std::lock_guard lock(mutex_);
        const auto known = damaged_.find(k);
        if (known == damaged_.end()) return k;
        known->second.wanted = true;
        return known->second.shown;
    }

    /// The frame that takes the place of a damaged one: the nearest sound one before it, or else
    /// the first one after. Remembers it for all that it passes, so that each is read once.
    int findFor(int k, const Error& error) {
        const std::lock_guard lock(mutex_);
        if (const auto known = damaged_.find(k); known != damaged_.end()) {
            known->second.wanted = true;
            return known->second.shown;
        }
        std::map<int, Damage> passed;
        passed.emplace(k, Damage{error, k});
        int shown = k;
        const auto tryFrame = [&](int other) {
            const auto picture = frames_->frame(other);
            if (picture)
                shown = other;
            else if (isDamage(picture.error()))
                passed.emplace(other, Damage{picture.error(), k});
        };
        for (int other = k - 1; shown == k && other >= 0; --other) {
            const auto known = damaged_.find(other);
            if (known == damaged_.end())
                tryFrame(other);
            else
                shown = known->second.shown;
        }
        for (int other = k + 1; shown == k && other < count(); ++other) tryFrame(other);
        for (auto& [at, damage] : passed) damage.shown = shown == k ? at : shown;
        damaged_.merge(passed);
        damaged_.at(k).wanted = true;
        return shown;
    }

    std::unique_ptr<VideoFrames> frames_;
    bool strict_;
    Job& job_;
    mutable std::mutex mutex_;
    std::map<int, Damage> damaged_;
};

Result<std::unique_ptr<VideoFrames>> openFilm(const fs::path& input, bool strict, Job& job) {
    auto opened = Film::open(input, job.limits);
    if (!opened && opened.error().code == ErrorCode::unsupported)
        return fail(ErrorCode::unsupported,
                    "{}; or take its frames out first: ffmpeg -i '{}' frame_%04d.png",
                    opened.error().text(), input.string());
    if (!opened) return propagate(opened);
    auto& film = **opened;
    const int track = film.firstVideo();
    STX_CHECK(film.select(track, strict, job));
    const auto videos = std::ranges::count_if(film.tracks(), &Film::Track::video);
    if (videos > 1)
        job.note(fmt::format("{} has {} tracks of video; the first is taken",
                             inQuotes(input.string()), videos));
    return std::make_unique<FilmFrames>(std::move(*opened), track, job);
}

/// Whether the first bytes, or the ending, are those of a video that has to be decoded.
bool isCompressedVideo(const fs::path& path, std::string_view head) {
    if (!filmFormatOf(std::as_bytes(std::span(head))).empty()) return true;
    std::string ending = path.extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(), [](char c) {
        return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    });
    constexpr std::string_view kEndings[] = {
        ".mp4", ".m4v", ".mov", ".avi", ".mkv",  ".webm", ".mpg",  ".mpeg", ".ts",  ".m2ts", ".mts",
        ".wmv", ".flv", ".3gp", ".ogv", ".h264", ".264",  ".hevc", ".265",  ".ivf", ".mjpeg"};
    return std::find(std::begin(kEndings), std::end(kEndings), ending) != std::end(kEndings);
}

std::string headOfFile(const fs::path& path) {
    std::string head(16, '\0');
    std::ifstream file(path, std::ios::binary);
    file.read(head.data(), static_cast<std::streamsize>(head.size()));
    head.resize(static_cast<std::size_t>(std::max<std::streamsize>(0, file.gcount())));
    return head;
}

Result<std::unique_ptr<VideoFrames>> openPictures(std::vector<fs::path> files, std::string what,
                                                  bool strict, Job& job) {
    // Those of a folder, and those that a mask named after its frame ('{stem}.png') would replace.
    if (files.size() > 1)
        for (const fs::path& file : files) rememberNamedFile(file);
    auto frames = std::make_unique<PictureFrames>(std::move(files), std::move(what), job);
    STX_CHECK(frames->open(strict));
    return frames;
}

Result<std::unique_ptr<VideoFrames>> openSequence(Result<std::vector<NumberedFile>> pictures,
                                                  const fs::path& input, bool strict, Job& job) {
    if (!pictures) return propagate(pictures);
    if (const auto missing = strict ? firstMissing(*pictures) : std::nullopt)
        return fail(ErrorCode::invalidInput,
                    "'{}': frame {} is missing; without --strict the others are taken",
                    input.string(), *missing);
    std::vector<fs::path> files;
    for (auto& picture : *pictures) files.push_back(std::move(picture.path));
    return openPictures(std::move(files), input.string(), strict, job);
}

Result<std::unique_ptr<VideoFrames>> openAnyFrames(const std::vector<fs::path>& inputs, bool strict,
                                                   Job& job) {
    if (inputs.empty()) return fail(ErrorCode::usage, "no frames are named");
    std::error_code ec;
    for (const fs::path& input : inputs) {
        const bool folder = fs::is_directory(input, ec);
        const bool there = fs::exists(fs::status(input, ec));
        if (inputs.size() == 1) {
            Job strictly;  // what is missing is an error, not a note
            Job& heard = strict ? strictly : job;
            if (folder) return openSequence(numberedPictures(input, heard), input, strict, job);
            if (!there && isSequencePattern(input))
                return openSequence(picturesOfPattern(input, heard), input, strict, job);
        }
        if (!there)
            return fail(ErrorCode::io, "cannot read '{}': {}", input.string(), whyNotThere(input));
        if (inputs.size() == 1 && input.extension() == ".json")
            return failAt(inQuotes(input.string()), ErrorCode::usage,
                          "plain frames are expected, but this may be a set of images with depth; "
                          "its background is a view of it: -o film.mp4 or film_%04d.exr");
        const bool regular = fs::is_regular_file(input, ec);
        const std::string head = regular ? headOfFile(input) : std::string();
        const bool film = regular && isCompressedVideo(input, head);
        const bool y4m =
            Y4mReader::recognises(std::as_bytes(std::span(head))) || input.extension() == ".y4m";
        if (inputs.size() > 1 && (folder || y4m || film))
            return fail(ErrorCode::usage,
                        "'{}' is {}; of several inputs each must be a picture (give it alone)",
                        input.string(), folder ? "a folder" : "a video");
        if (film) return openFilm(input, strict, job);
        if (!y4m) continue;
        STX_TRY(auto source, ByteSource::open(input));
        STX_TRY(auto reader,
                within(inQuotes(input.string()), Y4mReader::open(std::move(source), job)));
        return std::make_unique<Y4mFrames>(std::move(reader), input, job);
    }
    return openPictures(inputs, inputs.size() == 1 ? inputs[0].string() : "pictures", strict, job);
}

}  // namespace

Result<std::unique_ptr<VideoFrames>> openVideoFrames(const std::vector<fs::path>& inputs, Job& job,
                                                     bool strict) {
    STX_TRY(auto frames, openAnyFrames(inputs, strict, job));
    return std::make_unique<SteadyFrames>(std::move(frames), strict, job);
}

}  // namespace stx
