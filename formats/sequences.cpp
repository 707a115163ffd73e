#include "formats/sequences.hpp"

#include "formats/atlas/atlas_files.hpp"
#include "formats/exr/bundle_exr.hpp"
#include "formats/files/numbered.hpp"
#include "formats/mpeg4/mapping/scene_sequence.hpp"
#include "formats/mpeg4/mapping/sequence_write.hpp"
#include "formats/mpeg4/mpeg4.hpp"
#include "formats/open.hpp"
#include "formats/save.hpp"

namespace stx {
namespace {

namespace fs = std::filesystem;

constexpr double kUsualRate = 25;  ///< frames a second, where files do not tell their times

bool isNumberedExr(const fs::path& path) {
    const auto one = frameName(path.filename().string(), 0);
    return one && fs::path(*one).extension() == ".exr";
}

/// One OpenEXR bundle, or one atlas, for each frame.
class NumberedSequence : public Sequence {
  public:
    NumberedSequence(std::vector<NumberedFile> files, bool atlases, Timeline timeline)
        : files_(std::move(files)), atlases_(atlases) {
        timeline_ = std::move(timeline);
    }
    Result<Bundle> frame(std::size_t index, Job& job) override {
        const auto& path = files_[index].path;
        STX_TRY(auto bundle, atlases_ ? openBundle(path, {}, job) : readExrBundle(path, job));
        setTime(bundle, index);
        return bundle;
    }

  private:
    std::vector<NumberedFile> files_;
    bool atlases_;
};

/// When a file's moment is, and how long it is shown, where it tells.
struct Shown {
    std::optional<double> time, duration;
};
Result<Shown> shownOf(const fs::path& path, bool atlas, const Limits& limits) {
    if (!atlas) {
        STX_TRY(const auto header, readExrBundleHeader(path, limits));
        return Shown{header.time, header.duration};
    }
    STX_TRY(const auto header, readAtlasHeader(path, limits));
    return Shown{header.atlas.time, header.atlas.duration};
}

Result<std::unique_ptr<Sequence>> openNumbered(std::vector<NumberedFile> files,
                                               const fs::path& pattern, Job& job) {
    STX_TRY(const auto kind, recognise(files.front().path));
    const bool atlases = kind == FileKind::atlas;
    Timeline line;
    line.times.clear();
    std::vector<double> told;
    std::optional<double> last;
    for (const NumberedFile& file : files) {
        STX_CHECK(job.checkCancelled());
        STX_TRY(const auto shown, shownOf(file.path, atlases, job.limits));
        const auto& time = shown.time;
        if (!time) break;
        last = shown.duration;
        if (!told.empty() && !(*time > told.back()))
            return failAt(fmt::format("'{}'", file.path.string()), ErrorCode::invalidInput,
                          "its time is {:g} s, but the file before it is of {:g} s", *time,
                          told.back());
        told.push_back(*time);
    }
    if (told.size() == files.size()) {
        line.times = std::move(told);
    } else {
        last.reset();
        for (const NumberedFile& file : files)
            line.times.push_back(static_cast<double>(file.number - files.front().number) /
                                 kUsualRate);
        job.note(fmt::format("the files of '{}' do not all tell their time: {} frames a second",
                             pattern.string(), kUsualRate));
    }
    line.end = line.times.back();
    if (last)
        line.end += *last;
    else if (line.moves())
        line.end += line.times.back() - line.times[line.count() - 2];
    line.findTick();
    if (const auto sound = line.check(); !sound)
        return tl::unexpected(sound.error().at(fmt::format("'{}'", pattern.string())));
    return std::make_unique<NumberedSequence>(std::move(files), atlases, std::move(line));
}

}  // namespace

Result<std::unique_ptr<Sequence>> openSequence(const fs::path& path, const OpenOptions& options,
                                               Job& job) {
    std::error_code ec;
    if (frameName(path.filename().string(), 0) && !fs::exists(path, ec)) {
        auto files = numberedFiles(path.string());
        if (isNumberedExr(path) || (files && isAtlasFolder(files->front().path))) {
            if (!files) return propagate(files);
            return openNumbered(std::move(*files), path, job);
        }
    }
    STX_TRY(const auto kind, recognise(path));
    if (kind == FileKind::imageSet || !options.set.from.empty())
        return openImageSet(path, options.set, job);
    if (kind == FileKind::mpeg4) {
        STX_TRY(auto document, readMpeg4(path, job));
        mpeg4::SceneReadOptions read;
        read.folder = folderOf(path);
        auto sequence = mpeg4::sequenceFromScene(std::move(document), read, job);
        if (!sequence)
            return tl::unexpected(sequence.error().at(fmt::format("'{}'", path.string())));
        return sequence;
    }
    STX_TRY(auto bundle, openBundle(path, options, job));
    return sequenceOf(std::move(bundle));
}

bool holdsSequences(const fs::path& target) {
    return isNumberedExr(target) || mpeg4ContainerOf(target).has_value();
}

Result<void> saveSequence(Sequence& frames, const fs::path& target, const SaveOptions& options,
                          Job& job) {
    const std::size_t count = frames.timeline().count();
    if (count > 1 && !holdsSequences(target))
        return fail(ErrorCode::usage,
                    "'{}' holds one frame, but there are {}; .mp4, .xmt, .bt and a numbered name "
                    "as in name_%04d.exr hold more",
                    target.string(), count);
    if (isNumberedExr(target)) {
        for (std::size_t i = 0; i < count; ++i) {
            job.progress(static_cast<std::int64_t>(i), static_cast<std::int64_t>(count),
                         "writing frames");
            STX_CHECK(job.checkCancelled());
            STX_TRY(const auto bundle, frames.frame(i, job));
            STX_CHECK(
                saveBundle(bundle, *frameName(target.string(), static_cast<int>(i)), options, job));
        }
        return {};
    }
    if (count == 1) {
        STX_TRY(const auto bundle, frames.frame(0, job));
        return saveBundle(bundle, target, options, job);
    }
    STX_TRY(auto spool, mpeg4::PictureSpool::create(folderOf(target)));
    STX_TRY(const auto document, mpeg4::sceneFromSequence(frames, mpeg4Scene(options), spool, job));
    return writeMpeg4(document, target, job, mpeg4Write(options));
}

}  // namespace stx
