#include "formats/imagesets/image_sets.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <memory>

#include "formats/files/messages.hpp"
#include "formats/files/named_files.hpp"
#include "formats/files/not_there.hpp"
#include "formats/imagesets/kinds.hpp"
#include "formats/imagesets/motion.hpp"
#include "formats/imagesets/patterns.hpp"
#include "formats/imagesets/read_views.hpp"
#include "formats/imagesets/recognise.hpp"
#include "formats/imagesets/set_options.hpp"
#include "formats/imagesets/set_views.hpp"
#include "lib/geometry/origin.hpp"
#include "lib/model/sequence.hpp"

namespace stx {
namespace {

using namespace imagesets;

/// The masks that the options name, beside the set or where stx runs. Errors (usage): {frame} of a
/// set whose frames have times instead of numbers.
Result<void> nameMasks(SetDescription& set, const path& from, const ImageSetOptions& options) {
    const std::string& pattern = options.maskPattern;
    if (pattern.find("{frame") != std::string::npos &&
        std::ranges::any_of(set.views, [](const SetView& view) { return view.time.has_value(); }))
        return failAt(
            inQuotes(from.string()), ErrorCode::usage,
            "{{frame}} in --mask is the number of a frame, and these pictures have times; "
            "{{stem}} or {{name}} tells one mask from another");
    std::error_code ec;
    const path folder = std::filesystem::is_directory(from, ec) ? from : folderOf(from);
    for (SetView& view : set.views) {
        std::string name =
            filled(pattern, {view.name, view.camera.width, view.camera.height, options.frame});
        if (const auto at = name.find("{stem}"); at != std::string::npos)
            name.replace(at, 6, path(view.texture.name).stem().string());
        const path beside = folder / name;
        view.mask.path = std::filesystem::exists(beside, ec) ? beside : path(name);
        view.mask.name = name;
    }
    return {};
}

/// What the files say, without the options that are of every kind.
Result<SetDescription> describeFiles(const path& path, const ImageSetOptions& options, Job& job) {
    std::string kind = options.from;
    if (kind.empty() && !namesFilms(options)) {
        STX_TRY(kind, recogniseImageSet(path));
    }
    std::error_code ec;
    if (!std::filesystem::exists(path, ec))
        return failAt(inQuotes(path.string()), ErrorCode::io, "{}", whyNotThere(path));
    if (namesFilms(options)) {
        STX_CHECK(checkOptionsOf(kFilms, options, inQuotes(path.string()), job));
        return describeFilms(path, options, job);
    }
    const KindEntry* entry = kindNamed(kind);
    if (!entry) {
        std::string known;
        for (const ImageSetKind& k : imageSetKinds())
            known += fmt::format("{}{}", known.empty() ? "" : ", ", k.name);
        return fail(ErrorCode::usage, "'{}' is not a kind of image set; known are {}", kind, known);
    }
    STX_TRY(auto set, entry->describe(path, options, job));
    // Some kinds find their pictures in folders, not by names. A file that is given may be
    // replaced.
    for (const SetView& view : set.views)
        for (const PictureSource* source : {&view.texture, &view.depth, &view.mask})
            if (source->path != path) rememberNamedFile(source->path);
    // Behind what is wrong with the set: one that lacks files may be taken for another kind.
    STX_CHECK(checkOptionsOf(kind, options, inQuotes(path.string()), job));
    return set;
}

Result<void> checkOptions(const ImageSetOptions& o) {
    if (o.depthBits != 0 && o.depthBits != 8 && o.depthBits != 16 && o.depthBits != 32)
        return fail(ErrorCode::usage, "depth in {} bits; 8, 16 and 32 are possible", o.depthBits);
    if (o.frame < 0) return fail(ErrorCode::usage, "frame {}; frames count from 0", o.frame);
    if (!(o.depthUnit >= 0) || std::isinf(o.depthUnit))
        return fail(ErrorCode::usage, "the depth's unit is {:g}; it must be above 0", o.depthUnit);
    if (o.every < 1) return fail(ErrorCode::usage, "each {}-th view; 1 is the least", o.every);
    if ((o.depthMin != 0 || o.depthMax != 0) && !(o.depthMin > 0 && o.depthMin < o.depthMax))
        return fail(ErrorCode::usage,
                    "the depth range is {:g} to {:g}; the least must be above 0 and below the "
                    "greatest",
                    o.depthMin, o.depthMax);
    if (o.depthUnit > 0 && o.depthMax > 0)
        return fail(ErrorCode::usage,
                    "--depth-range and --depth-unit both say what depth is; give one of them");
    if (o.depthUnit > 0 && o.photo.nearIs != NearIs::unknown)
        return fail(ErrorCode::usage,
                    "--depth-near does not go with --depth-unit, whose steps are distances");
    return {};
}

/// Each N-th of all, from the first.
template <class T>
void takeEvery(std::vector<T>& all, int every) {
    if (every <= 1) return;
    std::vector<T> some;
    for (std::size_t i = 0; i < all.size(); i += static_cast<std::size_t>(every))
        some.push_back(std::move(all[i]));
    all = std::move(some);
}

/// Pictures of a film whose files are missing are left out, with a note: their cameras show those
/// before, and the film begins with the first that is there. Errors when `strict`, or when none is.
Result<void> leaveMissingOut(const SetDescription& set, Motion& motion, bool strict, Job& job) {
    for (std::size_t i = 0; i < set.views.size(); ++i)
        if (set.views[i].missing) motion.gone.emplace(i, *set.views[i].missing);
    if (motion.gone.empty()) return {};
    const Error& first = motion.gone.begin()->second;
    if (strict) return tl::unexpected(first);
    std::erase_if(motion.tracks, [&](const Motion::Track& track) {
        return std::ranges::all_of(
            track.views, [&](std::size_t picture) { return motion.gone.contains(picture); });
    });
    if (motion.tracks.empty()) return tl::unexpected(first);
    // All times are still there (see motionToRead()), that of a picture which is there among them.
    while (motion.times.size() > 1 && motion.nothingBegan(set, 0))
        motion.times.erase(motion.times.begin());
    job.note(
        fmt::format("{} of {} pictures {} missing, and their cameras show the ones before; the "
                    "first: {}",
                    motion.gone.size(), set.views.size(), motion.gone.size() == 1 ? "is" : "are",
                    first.text()));
    return {};
}

/// How a set moves, with each N-th view or moment of it; see leaveMissingOut(). Where one moment is
/// left of a film, its pictures become the views of a set that stands still.
Result<Motion> motionToRead(SetDescription& set, const ImageSetOptions& options,
                            const std::string& where, Job& job) {
    STX_TRY(Motion motion, within(where, motionOf(set, options)));
    if (!motion.moves()) {
        takeEvery(set.views, options.every);
        return motion;
    }
    if (motion.doubtfulCameras > 0)
        job.note(
            fmt::format("pictures of one pose are taken for those of one camera, which makes {} "
                        "cameras; 'camera' of each frame says otherwise",
                        motion.doubtfulCameras));
    // Before moments are left out: the film begins with the first of them that shows something.
    STX_CHECK(within(where, leaveMissingOut(set, motion, options.strict, job)));
    takeEvery(motion.times, options.every);
    if (motion.moves()) return motion;
    set.views = motion.moment(set, 0).views;
    return Motion();
}

/// Puts the damaged picture of a track that is shown at a frame with those that are gone, and the
/// ones that would be shown in its place and are damaged, too. Errors: all of the track are.
Result<void> passOver(const SetDescription& set, Motion& motion, const Motion::Track& track,
                      std::size_t frame, Error error, const std::string& where,
                      const ImageSetOptions& options, Job& job) {
    if (!motion.damaged) {
        const SetView& view = set.views[*motion.pictureAt(set, track, frame)];
        job.noteAbove(
            fmt::format("the picture of camera '{}' at {:.6g} s cannot be used: the one before it "
                        "is shown on, and no more is said of others like it; stx convert --strict "
                        "stops there: {}",
                        track.name, *view.time, error.text()));
    }
    motion.damaged = true;
    for (std::optional<Error> failed = error; failed;) {
        motion.gone.emplace(*motion.pictureAt(set, track, frame), *failed);
        const auto next = motion.pictureAt(set, track, frame);
        if (!next) return tl::unexpected(std::move(error));
        STX_CHECK(job.checkCancelled());
        SetDescription alone;
        alone.origin = set.origin;
        alone.views = {set.views[*next]};
        Job quiet;
        quiet.workFor(job);
        const auto read = readViews(std::move(alone), where, options, quiet);
        failed.reset();
        if (!read && isDamage(read.error())) failed = read.error();
    }
    return {};
}

/// Reads a set of one moment as a Bundle or a table: readViews(), or tableOfViews().
template <class T>
using ReadSet = std::function<Result<T>(SetDescription set, const ImageSetOptions& options,
                                        Job& job, std::optional<std::size_t>* failing)>;

ReadSet<Bundle> whole(const std::string& where) {
    return [where](SetDescription set, const ImageSetOptions& options, Job& job,
                   std::optional<std::size_t>* failing) {
        return readViews(std::move(set), where, options, job, failing);
    };
}
ReadSet<std::unique_ptr<ViewTable>> asTable(const std::string& where, std::uint64_t held,
                                            std::shared_ptr<std::atomic<bool>> said) {
    return [where, held, said = std::move(said)](SetDescription set, const ImageSetOptions& options,
                                                 Job& job, std::optional<std::size_t>* failing) {
        return tableOfViews(std::move(set), where, options, held, job, failing, said);
    };
}

/// A moment of a film. Pictures that are damaged join those that are gone, with a note of the
/// first. Errors where it has none at all, or `strict`.
template <class T>
Result<T> momentOf(const SetDescription& set, Motion& motion, std::size_t frame,
                   const std::string& where, const ImageSetOptions& options, Job& job,
                   const ReadSet<T>& read) {
    for (;;) {
        if (motion.nothingBegan(set, frame))
            return tl::unexpected(motion.gone.at(motion.tracks.front().views.front()));
        std::optional<std::size_t> failing;
        Job attempt;
        attempt.workFor(job);
        auto views = read(motion.moment(set, frame), options, attempt, &failing);
        if (views || !failing || options.strict || !isDamage(views.error())) {
            attempt.passNotesOn();
            return views;
        }
        STX_CHECK(passOver(set, motion, motion.tracks[*failing], frame, views.error(), where,
                           options, job));
    }
}

/// The description of a set by its first frame that can be described: of a film whose frames are
/// files with numbers the first ones may be missing or damaged, unless `strict`.
Result<SetDescription> describeFirst(const std::filesystem::path& path,
                                     const ImageSetOptions& options, Job& job) {
    auto set = describeSet(path, options, job);
    if (set || options.strict || options.frame != 0 || !isDamage(set.error())) return set;
    constexpr int kMostLost = 10;  // more at the beginning are a set that is not there
    for (int frame = 1; frame <= kMostLost; ++frame) {
        STX_CHECK(job.checkCancelled());
        Job quiet;
        quiet.workFor(job);
        ImageSetOptions later = options;
        later.frame = frame;
        auto other = describeSet(path, later, quiet);
        if (!other || other->frames <= frame) continue;
        quiet.passNotesOn();
        return other;
    }
    return set;
}

/// Options for the moments of what moves: cameras of each by itself would tremble, and in some of
/// them a camera may see nothing.
ImageSetOptions ofMoment(ImageSetOptions options) {
    options.ofFilm = true;
    if (options.refine.of(RefineStep::poses) == RefineSwitch::automatic)
        options.refine.set(RefineStep::poses, false);
    return options;
}

/// A set whose moments are in its description, or one that is described again for each frame.
class SetSequence : public Sequence {
  public:
    SetSequence(std::filesystem::path path, ImageSetOptions options, SetDescription set,
                Motion motion)
        : path_(std::move(path)),
          options_(ofMoment(std::move(options))),
          set_(std::move(set)),
          motion_(std::move(motion)) {
        if (motion_.moves()) {
            timeline_ = motion_.timeline();
        } else if (set_.frames > 1) {
            const int count = (set_.frames + options_.every - 1) / options_.every;
            timeline_ = steadyTimeline(count, set_.rate / options_.every);
            // Of a film whose length is not a multiple of N the last frame is shown for less than
            // N.
            if (timeline_.moves()) {
                timeline_.end = set_.frames / set_.rate;
                timeline_.findTick();
            }
        }
        // One origin for all frames, from what is known before a pixel is read.
        if (set_.origin) return;
        Bounds places;
        for (const SetView& view : set_.views) places.add(view.camera.position);
        if (!places.empty())
            if (const auto origin = originFor(places); origin != glm::dvec3(0.0))
                set_.origin = origin;
    }

    Result<Bundle> frame(std::size_t index, Job& job) override {
        STX_TRY(auto bundle, read(index, job, whole(inQuotes(path_.string()))));
        finish(bundle, index);
        return bundle;
    }
    Result<std::unique_ptr<ViewTable>> views(std::size_t index, Job& job) override {
        STX_TRY(auto table,
                read(index, job, asTable(inQuotes(path_.string()), heldWhole(job.limits), said_)));
        finish(table->about(), index);
        return table;
    }

  private:
    template <class T>
    Result<T> read(std::size_t index, Job& job, const ReadSet<T>& of) {
        const std::string where = inQuotes(path_.string());
        return motion_.moves() ? momentOf(set_, motion_, index, where, options_, job, of)
                               : described(index, where, job, of);
    }
    /// What all frames share, and the time.
    void finish(Bundle& bundle, std::size_t index) {
        if (!environment_) environment_ = bundle.environment;
        set_.environment.clear();
        bundle.environment = environment_;
        setTime(bundle, index);
    }

    /// A frame of a set that is described again for each, with all its cameras.
    template <class T>
    Result<T> described(std::size_t index, const std::string& where, Job& job,
                        const ReadSet<T>& of) {
        ImageSetOptions options = options_;
        options.frame = static_cast<int>(index) * options_.every;
        STX_TRY(auto now, describeSet(path_, options, job));
        for (const SetView& camera : set_.views)
            if (std::ranges::find(now.views, camera.name, &SetView::name) == now.views.end())
                return failAt(where, ErrorCode::io, "camera '{}' has no picture of frame {}",
                              camera.name, options.frame);
        if (set_.origin) now.origin = set_.origin;
        if (environment_) now.environment.clear();
        return of(std::move(now), options_, job, nullptr);
    }

    std::shared_ptr<const Environment> environment_;
    std::shared_ptr<std::atomic<bool>> said_ = std::make_shared<std::atomic<bool>>(false);
    std::filesystem::path path_;
    ImageSetOptions options_;
    SetDescription set_;
    Motion motion_;
};

/// A set of one moment: opening it reads no pixel.
class StillSet : public Sequence {
  public:
    StillSet(std::string where, ImageSetOptions options, SetDescription set)
        : where_(std::move(where)), options_(std::move(options)), set_(std::move(set)) {
        options_.roundFrames = true;  // it has no frames
    }

    Result<Bundle> frame(std::size_t index, Job& job) override {
        if (index > 0)
            return failAt(where_, ErrorCode::usage, "frame {} is asked for, but there is one (0)",
                          index);
        return readViews(set_, where_, options_, job);
    }
    Result<std::unique_ptr<ViewTable>> views(std::size_t index, Job& job) override {
        if (index > 0) return Sequence::views(index, job);
        return tableOfViews(set_, where_, options_, heldWhole(job.limits), job);
    }

  private:
    std::string where_;
    ImageSetOptions options_;
    SetDescription set_;
};

}  // namespace

Result<SetDescription> imagesets::describeSet(const path& path, const ImageSetOptions& options,
                                              Job& job) {
    STX_TRY(SetDescription set, describeFiles(path, options, job));
    if (!options.maskPattern.empty()) STX_CHECK(nameMasks(set, path, options));
    return set;
}

namespace {

/// What a set that is read says, and how it moves.
struct Described {
    SetDescription set;
    Motion motion;
};

/// Errors where the frame that is asked for is not in it.
Result<Described> describeToRead(const std::filesystem::path& path, const ImageSetOptions& options,
                                 Job& job) {
    STX_CHECK(checkOptions(options));
    Described out;
    STX_TRY(out.set, describeSet(path, options, job));
    const std::string where = inQuotes(path.string());
    STX_TRY(out.motion, motionToRead(out.set, options, where, job));
    // What is not there says more than a number that is too large.
    if (!out.motion.moves()) {
        STX_CHECK(dropMissing(out.set, options.strict, job));
        STX_CHECK(checkFilesAreThere(out.set));
    }
    const auto frames =
        out.motion.moves() ? static_cast<int>(out.motion.times.size()) : out.set.frames;
    if (options.frame >= frames)
        return failAt(where, ErrorCode::invalidInput,
                      "frame {} is asked for, but the set has {} (from 0)", options.frame, frames);
    return out;
}

/// The moment of a set that moves that the options name.
template <class T>
Result<T> momentAsked(Described& described, const std::string& where,
                      const ImageSetOptions& options, Job& job, const ReadSet<T>& read) {
    Motion& motion = described.motion;
    if (options.frame == 0)
        job.note(fmt::format("the set moves: {} frames over {:.4g} s; this is the first",
                             motion.times.size(), motion.timeline().duration()));
    const auto frame = static_cast<std::size_t>(options.frame);
    return momentOf(described.set, motion, frame, where, ofMoment(options), job, read);
}

}  // namespace

Result<Bundle> readImageSet(const std::filesystem::path& path, const ImageSetOptions& options,
                            Job& job) {
    const std::string where = inQuotes(path.string());
    STX_TRY(auto described, describeToRead(path, options, job));
    if (described.motion.moves()) {
        STX_TRY(auto bundle, momentAsked(described, where, options, job, whole(where)));
        bundle.time = described.motion.times[static_cast<std::size_t>(options.frame)];
        return bundle;
    }
    return readViews(std::move(described.set), where, options, job);
}

Result<std::unique_ptr<ViewTable>> openSetViews(const std::filesystem::path& path,
                                                const ImageSetOptions& options, Job& job,
                                                std::uint64_t held) {
    const std::string where = inQuotes(path.string());
    STX_TRY(auto described, describeToRead(path, options, job));
    if (!described.motion.moves())
        return tableOfViews(std::move(described.set), where, options, held, job);
    STX_TRY(auto table, momentAsked(described, where, options, job, asTable(where, held, nullptr)));
    table->about().time = described.motion.times[static_cast<std::size_t>(options.frame)];
    return table;
}

Result<std::unique_ptr<Sequence>> openImageSet(const std::filesystem::path& path,
                                               const ImageSetOptions& options, Job& job) {
    STX_CHECK(checkOptions(options));
    STX_TRY(SetDescription set, describeFirst(path, options, job));
    const std::string where = inQuotes(path.string());
    STX_TRY(Motion motion, motionToRead(set, options, where, job));
    if (set.views.empty())
        return failAt(where, ErrorCode::invalidInput, "it has no view; at least one is expected");
    if (set.frames == 1 && !motion.moves())
        return std::make_unique<StillSet>(where, options, std::move(set));
    if (options.refine.atImport(RefineStep::poses, false))
        return failAt(where, ErrorCode::usage,
                      "it moves, and the step 'poses' is of one moment; give --frame N or --still, "
                      "or leave the step out");
    return std::make_unique<SetSequence>(path, options, std::move(set), std::move(motion));
}

Result<int> imageSetFrameCount(const std::filesystem::path& path, const ImageSetOptions& options,
                               Job& job) {
    STX_CHECK(checkOptions(options));
    STX_TRY(SetDescription set, describeSet(path, options, job));
    STX_TRY(const Motion motion, motionToRead(set, options, inQuotes(path.string()), job));
    return motion.moves() ? static_cast<int>(motion.times.size()) : set.frames;
}

}  // namespace stx
