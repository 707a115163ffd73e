#include <algorithm>
#include <atomic>
#include <optional>
#include <utility>

#include "formats/exr/environment_exr.hpp"
#include "formats/files/file_stamp.hpp"
#include "formats/files/messages.hpp"
#include "formats/imagesets/read_views.hpp"
#include "lib/base/parallel.hpp"
#include "lib/model/depth_values.hpp"
#include "lib/model/linear_views.hpp"
#include "lib/refine/refine_needed.hpp"
#include "lib/registration/disagreement_by_view.hpp"

namespace stx::imagesets {
namespace {

/// What reading takes at its peak beside the images of a view that it gives, bytes a pixel: lines
/// of files, depth as it was stored, and another copy of the images where a lens is undone.
constexpr std::uint64_t kReadingTakes = 8;

/// The files of a view as they were when it was read first.
class FilesOfView {
  public:
    FilesOfView() = default;
    explicit FilesOfView(const SetView& view) {
        for (const PictureSource* source : {&view.texture, &view.depth, &view.mask})
            if (!source->path.empty()) files_.emplace_back(source->path, stampOf(source->path));
    }
    /// Errors (invalidInput) with the first that has changed since.
    [[nodiscard]] Result<void> check() const {
        for (const auto& [file, stamp] : files_)
            if (stampOf(file) != stamp) return changedError(file.string());
        return {};
    }

  private:
    std::vector<std::pair<std::filesystem::path, std::optional<FileStamp>>> files_;
};

/// What the first look at each view leaves.
struct Looked {
    std::vector<ViewImageKinds> kinds;
    std::vector<FilesOfView> files;
    bool linear = false;      ///< some picture holds linear light: all are to
    bool posesAsked = false;  ///< poses were to be aligned, or left
    std::unique_ptr<DisagreementByView> disagreement;
    std::shared_ptr<std::atomic<bool>> said;  ///< that they disagree
    ColourPoints points;  ///< of what is given; empty where that is not what was looked at
};

/// A set whose views are read again whenever they are asked for.
class SetViews : public ViewTable, public ViewsLookedAt {
  public:
    SetViews(Bundle headers, SetDescription set, std::string where, ImageSetOptions options,
             Looked looked)
        : ViewTable(std::move(headers), looked.kinds),
          set_(std::move(set)),
          where_(std::move(where)),
          options_(std::move(options)),
          looked_(std::move(looked)) {}

    std::uint64_t bytesToMake(std::size_t index) const override {
        return 2 * bytesOf(index) + kReadingTakes * pixelsOf(index);
    }
    bool knownSound() const override { return true; }
    std::string where() const override { return where_; }
    const ColourPoints* colourPoints() const override {
        return looked_.points.empty() ? nullptr : &looked_.points;
    }

  protected:
    Result<std::shared_ptr<const ReferenceView>> make(std::size_t index, Job& job) const override {
        // Its notes have been said, and what was refined has been told.
        Job quiet;
        quiet.workFor(job);
        if (quiet.limits.keepDamaged) quiet.limits.keepDamaged = [](const std::string&) {};
        RefineReport report;
        bool nothing = false;
        auto loaded = loadOne(set_.views[index], options_, report, nothing, quiet);
        STX_CHECK(job.checkCancelled());
        STX_CHECK(within(where_, looked_.files[index].check()));
        if (!loaded) return tl::unexpected(loaded.error().at(where_));
        auto view = std::make_shared<ReferenceView>(std::move(loaded->front()));
        const ViewHeader& header = about().views[index];
        view->name = header.name;
        view->camera = header.camera;
        view->refined = header.refined;
        if (looked_.linear) makeLinear(*view);
        if (looked_.disagreement->compare(index, view->depth, about()))
            if (const auto note = disagreementNote(about(), looked_.disagreement->result(),
                                                   looked_.posesAsked || posesWereAligned(about()));
                note && !looked_.said->exchange(true))
                job.noteAbove(*note);
        return view;
    }

  private:
    SetDescription set_;
    std::string where_;
    ImageSetOptions options_;
    Looked looked_;
};

/// Whether each view of a set can be made from its own files alone, at any time: the faces of
/// panoramas come together, and frames of video one after another.
bool standAlone(const SetDescription& set, const ImageSetOptions& options) {
    return !(set.photo && options.photo.behindPercent > 0) &&
           std::ranges::none_of(set.views, [](const SetView& view) {
               return view.panorama || view.texture.film || view.depth.film;
           });
}

/// Memory of the images of a set, at least; none where sizes are not known before they are read.
std::optional<std::uint64_t> memoryOfImages(const SetDescription& set) {
    std::uint64_t bytes = 0;
    for (const SetView& view : set.views) {
        if (view.camera.width <= 0 || view.camera.height <= 0) return {};
        bytes += static_cast<std::uint64_t>(view.camera.width) *
                 static_cast<std::uint64_t>(view.camera.height) *
                 (sizeof(float) + sizeof(glm::u8vec4));
    }
    return bytes;
}

/// How many views may be read at a time under the limit, by the largest whose size is known. Errors
/// (invalidInput): not even that one.
Result<std::size_t> viewsAtOnce(const SetDescription& set, const Limits& limits) {
    std::uint64_t most = 1;
    for (const SetView& view : set.views) {
        const auto pixels = static_cast<std::uint64_t>(std::max(view.camera.width, 0)) *
                            static_cast<std::uint64_t>(std::max(view.camera.height, 0));
        const std::uint64_t takes =
            pixels * (2 * (sizeof(float) + sizeof(glm::u8vec4)) + kReadingTakes);
        STX_CHECK(checkPeak({"reading", 0}, pixels, pixels, takes, limits));
        most = std::max(most, takes);
    }
    return static_cast<std::size_t>(std::clamp<std::uint64_t>(
        limits.maxMemoryBytes / most, 1, static_cast<std::uint64_t>(threadCount())));
}

}  // namespace

Result<std::unique_ptr<ViewTable>> tableOfViews(SetDescription set, const std::string& where,
                                                const ImageSetOptions& options, std::uint64_t held,
                                                Job& job, std::optional<std::size_t>* failing,
                                                std::shared_ptr<std::atomic<bool>> said) {
    const auto memory = memoryOfImages(set);
    if (set.views.size() < 2 || (memory && *memory <= held) || !standAlone(set, options)) {
        STX_TRY(auto bundle, readViews(std::move(set), where, options, job, failing));
        return tableOf(std::move(bundle));
    }
    STX_CHECK(prepareToRead(set, where, options, job));
    const std::size_t count = set.views.size();
    Bundle headers;
    headers.title = set.title;
    headers.views.resize(count);
    Looked looked;
    looked.kinds.resize(count);
    looked.points.resize(count);
    looked.disagreement = std::make_unique<DisagreementByView>(count);
    looked.said = said ? std::move(said) : std::make_shared<std::atomic<bool>>(false);
    for (const SetView& view : set.views) looked.files.emplace_back(view);
    std::vector<Bounds> bounds(count);
    std::vector<PoseSample> samples(count);
    const auto look = [&](std::size_t i, std::vector<ReferenceView> views) -> Result<void> {
        const ReferenceView& view = views.front();
        if (auto ok = view.check(); !ok)
            return tl::unexpected(ok.error().at(fmt::format("view {}", i)));
        static_cast<ViewHeader&>(headers.views[i]) = view;
        headers.views[i].colourFile = {};
        looked.kinds[i] = ViewImageKinds::of(view);
        bounds[i] = view.computeBounds();
        looked.disagreement->sample(i, view.depth);
        looked.points[i] = colourPointsOf(view);
        if (options.refine.atImport(RefineStep::poses, depthWasMeasured(view)))
            samples[i] = poseSampleOf(view, samplePixels(count));
        return {};
    };
    STX_TRY(const std::size_t atOnce, within(where, viewsAtOnce(set, job.limits)));
    Job first;
    first.workFor(job);
    STX_TRY(LoadedViews loaded, loadEach(set, where, options, atOnce, first, failing, look));
    if (!loaded.showNothing.empty()) {
        // All that was found has their numbers: the others are looked at again.
        leaveOut(loaded, set, job);
        return tableOfViews(std::move(set), where, options, held, job, failing, looked.said);
    }
    first.passNotesOn();
    makeNamesUnique(headers.views);
    looked.linear = std::ranges::any_of(looked.kinds, &ViewImageKinds::linear);
    for (ViewImageKinds& kinds : looked.kinds) kinds.linear = looked.linear;
    if (!set.environment.empty()) {
        STX_TRY(headers.environment, readEnvironmentExr(set.environment, job));
    }
    headers.bounds = boundsTogether(bounds);
    const glm::dvec3 subtracted = findOrigin(headers, set, job);
    if (const auto when = alignsPoses(headers, options)) {
        looked.posesAsked = when == AlignPoses::asked;
        for (std::size_t i = 0; i < count; ++i)
            samples[i].header.camera.position = headers.views[i].camera.position;
        STX_CHECK(alignCameras(headers, std::move(samples), *when, bounds, subtracted,
                               loaded.report, job));
    }
    if (looked.linear || subtracted != glm::dvec3(0.0) || posesWereAligned(headers))
        looked.points.clear();
    if (options.refined) options.refined(loaded.report);
    return std::make_unique<SetViews>(std::move(headers), std::move(set), where, options,
                                      std::move(looked));
}

}  // namespace stx::imagesets
