#include <algorithm>
#include <utility>

#include "formats/exr/environment_exr.hpp"
#include "formats/files/files.hpp"
#include "formats/files/messages.hpp"
#include "formats/imagesets/export.hpp"
#include "formats/imagesets/export_files.hpp"
#include "lib/model/same_pictures.hpp"

namespace stx {
namespace {

using namespace imagesets;

namespace fs = std::filesystem;

/// One unit is for all frames, with codes for things that go away from the camera: to twice the
/// farthest distance of the first frame. Small scenes have codes to spare: 4,095 steps to that
/// distance are fine enough, and next to nothing goes 16 times as far.
constexpr DepthReach kFilmReach{.small = 16, .large = 2};

/// A folder of transforms.json, images/ and depth/ that fills frame by frame.
class FrameExporter {
  public:
    FrameExporter(Sequence& frames, const ExportOptions& options, Job& job)
        : frames_(frames), options_(options), job_(job) {}

    Result<void> write(const fs::path& folder) {
        STX_CHECK(frames_.timeline().check());
        const std::size_t count = frames_.timeline().count();
        STX_TRY(auto output, OutputFolder::create(folder, {options_.noClobber},
                                                  {"transforms.json", kEnvironmentFile}));
        root_ = output.temporaryPath();
        STX_CHECK(makeImageFolders(root_, folder));
        json_["stx:end"] = frames_.timeline().end;
        for (std::size_t i = 0; i < count; ++i) {
            job_.progress(static_cast<std::int64_t>(i), static_cast<std::int64_t>(count),
                          "writing frames");
            STX_CHECK(job_.checkCancelled());
            if (auto done = add(i); !done)
                return tl::unexpected(done.error().at(frames_.timeline().nameOf(i)));
        }
        // The first of each camera, by which readers number them: one that starts late keeps its
        // place.
        for (WrittenView& track : tracks_)
            if (!track.first.empty()) json_["frames"].push_back(std::move(track.first));
        for (OutputJson& frame : later_) json_["frames"].push_back(std::move(frame));
        STX_TRY(const std::string text, setText(json_));
        STX_CHECK(writeFile(root_ / "transforms.json",
                            std::as_bytes(std::span(text.data(), text.size()))));
        loss_.note(job_);
        return output.commit();
    }

  private:
    struct WrittenView {
        std::string name;  ///< of its newest files
        PicturesKey pictures;
        OutputJson first;
    };

    Result<void> add(std::size_t index) {
        // Notes are those of the first frame.
        Job quiet;
        quiet.workFor(job_);
        Job& job = index == 0 ? job_ : quiet;
        STX_TRY(auto table, frames_.views(index, job));
        // The unit follows from the first frame's planes.
        if (index == 0 && !table->planesKnown()) {
            STX_TRY(auto whole, wholeBundle(std::move(table), job));
            table = tableOf(std::move(whole));
        }
        const Bundle& about = std::as_const(*table).about();
        if (index == 0)
            STX_CHECK(begin(*table));
        else
            STX_CHECK(checkSameViews(first_, about));
        std::vector<OutputJson> shown(table->count());
        const auto write = [&](std::size_t k,
                               const std::shared_ptr<const ReferenceView>& view) -> Result<void> {
            if (auto sound = view->check(); !sound)
                return tl::unexpected(sound.error().at(fmt::format("view {}", k)));
            STX_CHECK(writeView(*view, k, index));
            if (tracks_[k].name.empty()) return {};
            shown[k] = transformsFrame(*view, view->texture.isLinear(), tracks_[k].name, options_,
                                       about.origin);
            shown[k]["time"] = frames_.timeline().times[index];
            shown[k]["camera"] = view->name;
            return {};
        };
        STX_CHECK(forEachView(*table, peak::kExport, job, write));
        for (std::size_t k = 0; k < shown.size(); ++k)
            if (!shown[k].empty())
                (tracks_[k].first.empty() ? tracks_[k].first : later_.emplace_back()) =
                    std::move(shown[k]);
        return {};
    }

    Result<void> begin(const ViewTable& table) {
        const Bundle& bundle = table.about();
        json_["stx:title"] = bundle.title;
        const glm::dvec3& o = bundle.origin;
        if (o != glm::dvec3(0.0)) json_["stx:origin"] = {o.x, o.y, o.z};
        noteMaterialLeftOut(table, job_);
        double farthest = 0;
        for (const ViewImageKinds& kinds : table.kinds())
            if (kinds.normal || kinds.hasSplats())
                job_.note("normals and splats have no place in an image set and are left out");
        for (const ReferenceView& view : bundle.views) farthest = std::max(farthest, view.farPlane);
        first_ = headersOf(bundle);
        if (options_.depth == ExportOptions::Depth::png) {
            unit_ = integerDepthUnit(farthest, kFilmReach, job_);
            json_["integer_depth_scale"] = unit_;
        }
        tracks_.resize(bundle.views.size());
        names_ = fileNames(bundle);
        if (!bundle.environment) return {};
        json_["stx:environment"] = kEnvironmentFile;
        return writeEnvironmentExr(*bundle.environment, root_ / kEnvironmentFile, job_);
    }

    /// Nothing when it is what it was.
    Result<void> writeView(const ReferenceView& view, std::size_t k, std::size_t index) {
        WrittenView& track = tracks_[k];
        // A camera of which nothing is known yet has no picture.
        if (track.name.empty() && view.depthMayBeUnknown() && view.pointCount() == 0) return {};
        PicturesKey pictures = PicturesKey::of(view);
        if (index > 0 && pictures == track.pictures) return {};
        track.pictures = std::move(pictures);
        track.name = fmt::format("{}_{:04}", names_[k], index);
        loss_.look(view, options_);
        STX_CHECK(writeColour(view, root_ / "images" / track.name, options_));
        if (options_.depth != ExportOptions::Depth::png)
            return writeFloatDepth(view, root_ / "depth" / (track.name + endingOf(options_.depth)));
        if (view.farPlane > unit_ * 65535)
            return fail(ErrorCode::invalidInput,
                        "view '{}' reaches to {:g} scene units, which the unit of the first frame "
                        "({:.3g}) does not; give --depth exr",
                        view.name, view.farPlane, unit_);
        return writeIntegerDepth(view, root_ / "depth" / (track.name + ".png"),
                                 [&](double d) { return d / unit_; });
    }

    Sequence& frames_;
    const ExportOptions& options_;
    Job& job_;
    ColourLoss loss_;
    fs::path root_;
    OutputJson json_;
    std::vector<OutputJson> later_;  ///< frames behind the first of each view
    Bundle first_;                   ///< names and cameras
    std::vector<WrittenView> tracks_;
    std::vector<std::string> names_;
    double unit_ = 0.001;
};

}  // namespace

Result<void> exportFrames(Sequence& frames, const fs::path& folder, const ExportOptions& options,
                          Job& job) {
    if (!frames.timeline().moves()) {
        STX_TRY(const auto table, frames.views(0, job));
        return exportViews(*table, folder, options, job);
    }
    if (options.kind != ExportOptions::Kind::transforms)
        return fail(
            ErrorCode::usage,
            "there are {} frames, and {} has one moment; give --time T, or take "
            "transforms.json",
            frames.timeline().count(),
            options.kind == ExportOptions::Kind::miv ? "a set for MIV" : "COLMAP's workspace");
    return FrameExporter(frames, options, job).write(folder);
}

}  // namespace stx
