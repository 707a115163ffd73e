#include "formats/any/sequences.hpp"

#include <optional>
#include <utility>

#include "formats/any/open.hpp"
#include "formats/any/save.hpp"
#include "formats/atlas/atlas_files.hpp"
#include "formats/exr/bundle_exr.hpp"
#include "formats/files/file_stamp.hpp"
#include "formats/files/files.hpp"
#include "formats/files/named_files.hpp"
#include "formats/files/no_case.hpp"
#include "formats/files/numbered.hpp"
#include "formats/mpeg4/mapping/scene_sequence.hpp"
#include "formats/mpeg4/mapping/sequence_write.hpp"
#include "formats/mpeg4/mpeg4.hpp"
#include "lib/model/from_origin.hpp"

namespace stx {
namespace {

namespace fs = std::filesystem;

constexpr double kUsualRate = 25;  ///< frames a second, where files do not tell their times

bool isNumberedExr(const fs::path& path) {
    const auto one = frameName(path.string(), 0);
    return one && lowerExtension(*one) == ".exr";
}

/// One OpenEXR bundle, or one atlas, for each frame.
class NumberedSequence : public Sequence {
  public:
    NumberedSequence(std::vector<NumberedFile> files, bool atlases, Timeline timeline,
                     std::string object, std::optional<FilmBounds> bounds)
        : files_(std::move(files)), guard_(pathsOf(files_)), atlases_(atlases), bounds_(bounds) {
        open_.object = std::move(object);
        timeline_ = std::move(timeline);
    }
    Result<Bundle> frame(std::size_t index, Job& job) override {
        const auto& path = files_[index].path;
        STX_TRY(auto bundle, atlases_ ? openBundle(path, open_, job) : readExrBundle(path, job));
        tell(bundle, index);
        return bundle;
    }
    Result<std::unique_ptr<ViewTable>> views(std::size_t index, Job& job) override {
        STX_TRY(auto table, openViews(files_[index].path, open_, job));
        tell(table->about(), index);
        return table;
    }

  private:
    /// What is of the film: when the frame is, and where all of them are, as MPEG-4 has it.
    void tell(Bundle& about, std::size_t index) const {
        setTime(about, index);
        if (!bounds_) return;
        const glm::dvec3 by = bounds_->origin - about.origin;
        about.bounds = Bounds{bounds_->bounds.min + by, bounds_->bounds.max + by};
    }

    static std::vector<fs::path> pathsOf(const std::vector<NumberedFile>& files) {
        std::vector<fs::path> paths;
        for (const NumberedFile& file : files) paths.push_back(file.path);
        return paths;
    }

    std::vector<NumberedFile> files_;
    FilesOfFilm guard_;
    bool atlases_;
    std::optional<FilmBounds> bounds_;
    OpenOptions open_;
};

/// A file of one moment. Its views are given away when they are asked for first, since two would be
/// twice the memory, and opened again for who asks again. That goes by the name, which may be that
/// of another file by then: an error.
class StillFile : public Sequence {
  public:
    StillFile(fs::path path, OpenOptions options)
        : path_(std::move(path)),
          options_(std::move(options)),
          mainFile_(mainFileOf(path_)),
          stamp_(stampOf(mainFile_)) {}
    /// To be called once, before all else.
    Result<void> open(Job& job) {
        STX_SET(table_, openViews(path_, options_, job));
        return {};
    }
    Result<Bundle> frame(std::size_t index, Job& job) override {
        STX_TRY(auto table, views(index, job));
        return wholeBundle(std::move(table), job);
    }
    Result<std::unique_ptr<ViewTable>> views(std::size_t index, Job& job) override {
        if (index > 0)
            return fail(ErrorCode::usage, "frame {} is asked for, but there is one (0)", index);
        if (table_) return std::move(table_);
        // Its notes have been said.
        Job quiet;
        quiet.workFor(job);
        auto table = openViews(path_, options_, quiet);
        // Looked at last: it may also be replaced while it is opened. One that is gone is an error
        // of opening.
        if (const auto now = stampOf(mainFile_); now && now != stamp_)
            return changedError(path_.string());
        return table;
    }

  private:
    /// An atlas may be a folder, whose own time need not tell of its files.
    static fs::path mainFileOf(const fs::path& path) {
        std::error_code ec;
        return fs::is_directory(path, ec) ? path / "atlas.json" : path;
    }

    fs::path path_;
    OpenOptions options_;
    fs::path mainFile_;
    std::optional<FileStamp> stamp_;  ///< from before it was opened
    std::unique_ptr<ViewTable> table_;
};

/// When a file's moment is, and how long it is shown, where it tells; and where its points are.
struct Shown {
    std::optional<double> time, duration;
    std::optional<Bounds> bounds;
    glm::dvec3 origin{0.0};
    bool noPoints = false;
};
/// What the header of a file says.
struct FrameHeader {
    Shown shown;
    bool atlas = false;
    Bundle about;  ///< its views and its time
};
Result<FrameHeader> headerOf(const fs::path& path, const std::string& object,
                             const Limits& limits) {
    FrameHeader out;
    STX_TRY(const auto kind, recognise(path));
    out.atlas = kind == FileKind::atlas;
    if (!out.atlas) {
        STX_TRY(const auto header, readExrBundleHeader(path, limits));
        const bool noPoints = std::ranges::all_of(
            header.views, [](const ExrViewHeader& view) { return view.points == 0; });
        out.shown = {header.time, header.duration, header.bounds, header.origin, noPoints};
        for (const ExrViewHeader& view : header.views) out.about.views.push_back(view.view);
    } else {
        STX_TRY(auto header, readAtlasHeader(path, limits));
        // Which of several it is shows when a frame is asked for.
        if (auto kept = keepObject(header.atlas, object); !kept && !object.empty())
            return tl::unexpected(kept.error().at(fmt::format("'{}'", path.string())));
        out.shown = {header.atlas.time, header.atlas.duration, header.atlas.bounds,
                     header.atlas.origin};
        out.about.views = std::move(header.atlas.views);
    }
    out.about.time = out.shown.time;
    return out;
}

/// Errors (invalidInput): a file that has other views than the first. It is not damaged, so that
/// the frame before it must not be shown for it.
Result<void> checkViewsOf(const fs::path& path, const Bundle& first, const Bundle& frame) {
    auto same = checkSameViews(first, frame);
    if (same) return {};
    Error other = same.error().at(fmt::format("'{}'", path.string()));
    other.message += "; the files of a film have the same views: give other ones other names";
    return tl::unexpected(std::move(other));
}

/// All together, from the first one's origin; none where a header does not tell.
std::optional<FilmBounds> boundsOf(const std::vector<Shown>& shown) {
    FilmBounds film;
    film.origin = shown.front().origin;
    for (const Shown& frame : shown) {
        if (frame.noPoints) continue;
        if (!frame.bounds || frame.bounds->empty()) return std::nullopt;
        const glm::dvec3 by = frame.origin - film.origin;
        film.bounds.add(frame.bounds->min + by);
        film.bounds.add(frame.bounds->max + by);
    }
    if (film.bounds.empty()) return std::nullopt;
    return film;
}

/// When the frame of a file is shown that does not tell it.
double usualTime(const NumberedFile& file, const NumberedFile& first) {
    return static_cast<double>(file.number - first.number) / kUsualRate;
}

/// The files that tell when they are shown. The others are left out with a note, so that those
/// before are shown on; they are errors when `strict`, or when none is left.
struct UsableFiles {
    std::vector<NumberedFile> files;
    std::vector<Shown> shown;
    bool atlases = false;
};
Result<UsableFiles> usableFiles(std::vector<NumberedFile> files, const fs::path& pattern,
                                const std::string& object, bool strict, Job& job) {
    UsableFiles film;
    Bundle views;  // of the first
    std::optional<Error> first;
    const auto all = files.size();
    if (const auto gap = firstMissing(files)) {
        const Error missing{ErrorCode::io,
                            fmt::format("'{}': number {} is missing, but files before and after "
                                        "it are there",
                                        pattern.string(), *gap),
                            {}};
        if (strict) return tl::unexpected(missing);
        job.note(
            fmt::format("{}: the frame before it is shown on, and no more is said of others "
                        "like it; stx convert --strict stops there",
                        missing.text()));
    }
    for (NumberedFile& file : files) {
        STX_CHECK(job.checkCancelled());
        auto header = headerOf(file.path, object, job.limits);
        if (!header) {
            if (strict || !isDamage(header.error())) return propagate(header);
            if (!first) first = header.error();
            continue;
        }
        if (film.files.empty()) {
            film.atlases = header->atlas;
            views = std::move(header->about);
        } else {
            if (!header->about.time) header->about.time = usualTime(file, film.files.front());
            STX_CHECK(checkViewsOf(file.path, views, header->about));
        }
        film.shown.push_back(header->shown);
        film.files.push_back(std::move(file));
    }
    if (film.files.empty()) return tl::unexpected(*first);
    if (first)
        job.note(
            fmt::format("{} of {} frames cannot be used: the ones before are shown on, and the "
                        "film begins with the first that can; stx convert --strict stops "
                        "there; the first: {}",
                        all - film.files.size(), all, first->text()));
    return film;
}

/// When the frames of files are shown: as they tell, or at the usual rate.
Result<Timeline> timelineOf(const UsableFiles& film, const fs::path& pattern, Job& job) {
    const auto& files = film.files;
    Timeline line;
    line.times.clear();
    std::optional<double> last;
    const bool told = std::ranges::all_of(film.shown, [](const Shown& s) { return !!s.time; });
    for (std::size_t i = 0; i < files.size(); ++i) {
        if (!told) {
            line.times.push_back(usualTime(files[i], files.front()));
            continue;
        }
        const double time = *film.shown[i].time;
        if (i > 0 && !(time > line.times.back()))
            return failAt(fmt::format("'{}'", files[i].path.string()), ErrorCode::invalidInput,
                          "its time is {:g} s, but the file before it is of {:g} s", time,
                          line.times.back());
        line.times.push_back(time);
        last = film.shown[i].duration;
    }
    if (!told)
        job.note(fmt::format("the files of '{}' do not all tell their time: {} frames a second",
                             pattern.string(), kUsualRate));
    line.end = line.times.back();
    if (last)
        line.end += *last;
    else if (line.moves())
        line.end += line.times.back() - line.times[line.count() - 2];
    line.findTick();
    STX_CHECK(within(fmt::format("'{}'", pattern.string()), line.check()));
    return line;
}

/// Frames as their files have them.
Result<std::unique_ptr<Sequence>> openFrames(const fs::path& path, const OpenOptions& options,
                                             Job& job) {
    STX_TRY(const auto kind, recognise(path));
    STX_CHECK(checkObject(path, kind, options));
    if (kind == FileKind::numbered) {
        STX_TRY(auto film, openNumbered(path, options, job));
        return std::move(film.frames);
    }
    if (kind == FileKind::imageSet || !options.set.from.empty())
        return openImageSet(path, options.set, job);
    if (kind == FileKind::mpeg4) {
        STX_TRY(auto document, readMpeg4(path, job));
        mpeg4::SceneReadOptions read;
        read.folder = folderOf(path);
        read.timesFromStart = options.timesFromStart;
        read.keepColourFiles = options.keepColourFiles;
        return within(fmt::format("'{}'", path.string()),
                      mpeg4::sequenceFromScene(std::move(document), read, job));
    }
    auto still = std::make_unique<StillFile>(path, options);
    STX_CHECK(still->open(job));
    return still;
}

}  // namespace

Result<std::unique_ptr<Sequence>> openSequence(const fs::path& path, const OpenOptions& options,
                                               Job& job) {
    STX_TRY(auto frames, openFrames(path, options, job));
    if (!frames->timeline().moves() || options.set.strict) return frames;
    return acrossDamage(std::move(frames));
}

Result<NumberedFilm> openNumbered(const fs::path& pattern, const OpenOptions& options, Job& job) {
    STX_TRY(auto all, numberedFiles(pattern.string()));
    STX_TRY(auto film,
            usableFiles(std::move(all), pattern, options.object, options.set.strict, job));
    if (!film.atlases) STX_CHECK(checkObject(pattern, FileKind::exr, options));
    STX_TRY(auto line, timelineOf(film, pattern, job));
    const auto bounds = boundsOf(film.shown);
    auto frames = std::make_unique<NumberedSequence>(std::move(film.files), film.atlases,
                                                     std::move(line), options.object, bounds);
    return NumberedFilm{fromOrigin(std::move(frames), film.shown.front().origin), bounds};
}

namespace {

/// All files appear when all frames are there, and none is one that the frames are read from.
Result<void> saveNumbered(Sequence& frames, const fs::path& target, const SaveOptions& options,
                          Job& job) {
    STX_CHECK(checkPattern(target.string()));
    // Those that stay are read with the new ones: a film has its pattern for itself.
    if (const auto older = numberedFiles(target.string()))
        for (const NumberedFile& file : *older) STX_CHECK(checkIsNotNamed(file.path));
    // Frames are drawn one after the other, each whole.
    SaveOptions each = options;
    each.summaries = SaveOptions::Summaries::none;
    const std::size_t count = frames.timeline().count();
    OutputFiles files;
    Bundle first;  // headers: files with other views than these are no film
    const auto add = [&](std::size_t i) -> Result<void> {
        STX_TRY(const auto table, frames.views(i, job));
        const Bundle& about = std::as_const(*table).about();
        if (i == 0)
            first = headersOf(about);
        else if (auto same = checkSameViews(first, about); !same)
            return fail(same.error().code,
                        "{}; the files of a film have the same views; stx render and stx extract "
                        "take one whose views change",
                        same.error().message);
        return saveViews(*table, *frameName(target.string(), static_cast<int>(i)), each, job,
                         &files);
    };
    for (std::size_t i = 0; i < count; ++i) {
        job.progress(static_cast<std::int64_t>(i), static_cast<std::int64_t>(count),
                     "writing frames");
        STX_CHECK(job.checkCancelled());
        if (const auto added = add(i); !added) {
            // What is asked for is wrong for all frames, and a single one needs no name.
            const bool ofFrame = count > 1 && added.error().code != ErrorCode::usage;
            return tl::unexpected(ofFrame ? added.error().at(frames.timeline().nameOf(i))
                                          : added.error());
        }
    }
    STX_CHECK(files.commit());
    noteOlderFiles(target.string(), count, job);
    return {};
}

}  // namespace

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
    if (isNumberedExr(target)) return saveNumbered(frames, target, options, job);
    if (count == 1) {
        STX_TRY(const auto table, frames.views(0, job));
        return saveViews(*table, target, options, job);
    }
    STX_TRY(auto spool, mpeg4::PictureSpool::create(folderBeside(target)));
    STX_TRY(const auto document, mpeg4::sceneFromSequence(frames, mpeg4Scene(options), spool, job));
    return writeMpeg4(document, target, job, mpeg4Write(options));
}

}  // namespace stx
