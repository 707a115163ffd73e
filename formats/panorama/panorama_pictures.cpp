#include <algorithm>
#include <mutex>

#include "formats/files/messages.hpp"
#include "formats/files/named_files.hpp"
#include "formats/images/exif.hpp"
#include "formats/images/images.hpp"
#include "formats/images/more_pictures.hpp"
#include "formats/panorama/panorama_files.hpp"
#include "formats/photos/file_colours.hpp"
#include "formats/photos/photo.hpp"
#include "formats/video/numbered_pictures.hpp"

namespace stx {
namespace {

namespace fs = std::filesystem;

/// Half the diagonal of a picture of 36x24 mm.
constexpr double kHalfDiagonal35 = 21.633;

/// What the camera wrote into a file.
Result<ExifNotes> notesOf(const Bytes& file, const Limits& limits) {
    if (!photos::isHeif(file)) return readExif(file);
    STX_TRY(const auto photo,
            photos::openPhoto(std::make_shared<const Bytes>(file), {.needsDepth = false}, limits));
    ExifNotes notes;
    notes.focal35 = photo.focal35;
    notes.oriented = true;  // its properties say how it is turned, or that it is not
    return notes;
}

class PictureFiles final : public PictureSource {
  public:
    PictureFiles(std::vector<fs::path> files, Job& job)
        : files_(std::move(files)),
          job_(job),
          loss_(job),
          kept_(files_.size()),
          notes_(files_.size()),
          room_(job.limits.maxMemoryBytes / 8) {}

    /// What the cameras wrote down.
    Result<void> open() {
        for (std::size_t k = 0; k < files_.size(); ++k) {
            STX_TRY(const auto bytes, readFile(files_[k], job_.limits));
            STX_TRY(notes_[k], within(inQuotes(files_[k].string()), notesOf(bytes, job_.limits)));
            noteMorePictures(bytes, files_[k].string(), job_);
        }
        return {};
    }
    [[nodiscard]] int count() const override { return static_cast<int>(files_.size()); }
    [[nodiscard]] std::string name(int k) const override { return files_[k].filename().string(); }
    [[nodiscard]] double focalHint(int k) const override {
        return notes_[k].focal35 / kHalfDiagonal35;
    }
    [[nodiscard]] bool oriented(int k) const override { return notes_[k].oriented; }
    [[nodiscard]] Result<Rgba8Image> picture(int k) override {
        const auto at = static_cast<std::size_t>(k);
        {
            const std::lock_guard lock(mutex_);
            if (!kept_[at].empty()) return kept_[at];
        }
        STX_TRY(const auto bytes, readFile(files_[at], job_.limits));
        Rgba8Loss loss;
        std::string colours;
        STX_TRY(Rgba8Image upright,
                photos::decodeAsShown(bytes, files_[at].string(), job_.limits, colours, &loss));
        loss_.add(loss);
        if (!colours.empty()) job_.noteOnce(colours);
        constexpr int kLeastSide = 32;
        if (std::min(upright.width(), upright.height()) < kLeastSide)
            return failAt(inQuotes(files_[at].string()), ErrorCode::invalidInput,
                          "it is {}x{}; a picture of a panorama has at least {} pixels a side",
                          upright.width(), upright.height(), kLeastSide);
        upright = shownOrNot(std::move(upright));
        const std::lock_guard lock(mutex_);
        const std::uint64_t size = upright.count() * sizeof(glm::u8vec4);
        if (kept_[at].empty() && size <= room_) {
            room_ -= size;
            kept_[at] = upright;
        }
        return upright;
    }

  private:
    std::vector<fs::path> files_;
    Job& job_;
    SharedRgba8Loss loss_;
    std::mutex mutex_;
    std::vector<Rgba8Image> kept_;
    std::vector<ExifNotes> notes_;
    std::uint64_t room_;  ///< bytes of pictures that may still be kept
};

Result<std::vector<fs::path>> filesOf(Result<std::vector<NumberedFile>> pictures) {
    if (!pictures) return propagate(pictures);
    std::vector<fs::path> files;
    for (auto& picture : *pictures) files.push_back(std::move(picture.path));
    return files;
}

}  // namespace

Result<std::unique_ptr<PictureSource>> openPanoramaPictures(const std::vector<fs::path>& inputs,
                                                            Job& job) {
    std::vector<fs::path> files = inputs;
    // Numbers may be missing: that is not a loss of a panorama's.
    Job aside;
    aside.limits = job.limits;
    std::error_code ec;
    if (inputs.size() == 1 && fs::is_directory(inputs[0], ec))
        STX_SET(files, filesOf(numberedPictures(inputs[0], aside)));
    else if (inputs.size() == 1 && !fs::exists(inputs[0], ec) && isSequencePattern(inputs[0]))
        STX_SET(files, filesOf(picturesOfPattern(inputs[0], aside)));
    for (const fs::path& file : files)
        if (fs::is_directory(file, ec))
            return fail(ErrorCode::usage,
                        "'{}' is a folder; of several inputs each must be a picture (give it "
                        "alone)",
                        file.string());
    for (const fs::path& file : files) rememberNamedFile(file);
    auto source = std::make_unique<PictureFiles>(std::move(files), job);
    STX_CHECK(source->open());
    return source;
}

}  // namespace stx
