#include <algorithm>

#include "formats/exr/environment_exr.hpp"
#include "formats/files/files.hpp"
#include "formats/files/messages.hpp"
#include "formats/imagesets/export.hpp"
#include "formats/imagesets/export_files.hpp"
#include "lib/base/parallel.hpp"
#include "lib/model/same_pictures.hpp"

namespace stx {
namespace {

using namespace imagesets;

namespace fs = std::filesystem;

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
                return tl::unexpected(done.error().at(
                    fmt::format("frame {} ({:g} s)", i, frames_.timeline().times[i])));
        }
        STX_TRY(const std::string text, setText(json_));
        STX_CHECK(writeFile(root_ / "transforms.json",
                            std::as_bytes(std::span(text.data(), text.size()))));
        loss_.note(job_);
        return output.commit();
    }

  private:
    /// What the files of a view were last.
    struct WrittenView {
        std::string name;  ///< of its newest files
        ReferenceView before;
    };

    Result<void> add(std::size_t index) {
        // Notes are those of the first frame.
        Job quiet;
        quiet.workFor(job_);
        STX_TRY(auto bundle, frames_.frame(index, index == 0 ? job_ : quiet));
        STX_CHECK(bundle.check());
        STX_CHECK(checkPeak(peak::kExport, bundle.views, job_.limits));
        if (index == 0)
            STX_CHECK(begin(bundle));
        else
            STX_CHECK(checkSameViews(first_, bundle));
        std::vector<Result<void>> written(bundle.views.size());
        parallelFor(0, static_cast<std::int64_t>(bundle.views.size()), [&](std::int64_t i) {
            const auto k = static_cast<std::size_t>(i);
            written[k] = writeView(bundle.views[k], k, index);
        });
        for (std::size_t k = 0; k < bundle.views.size(); ++k) {
            if (!written[k]) return propagate(written[k]);
            if (tracks_[k].name.empty()) continue;
            const ReferenceView& view = bundle.views[k];
            auto frame = transformsFrame(view, view.texture.isLinear(), tracks_[k].name, options_,
                                         bundle.origin);
            frame["time"] = frames_.timeline().times[index];
            frame["camera"] = bundle.views[k].name;
            json_["frames"].push_back(std::move(frame));
            tracks_[k].before = std::move(bundle.views[k]);
        }
        return {};
    }

    Result<void> begin(const Bundle& bundle) {
        json_["stx:title"] = bundle.title;
        const glm::dvec3& o = bundle.origin;
        if (o != glm::dvec3(0.0)) json_["stx:origin"] = {o.x, o.y, o.z};
        bundle.noteMaterialLeftOut(job_);
        double farthest = 0;
        for (const ReferenceView& view : bundle.views) {
            farthest = std::max(farthest, view.farPlane);
            if (view.hasNormals() || view.hasSplats())
                job_.note("normals and splats have no place in an image set and are left out");
            ReferenceView header;
            header.name = view.name;
            header.camera = view.camera;
            first_.views.push_back(std::move(header));
        }
        if (options_.depth == ExportOptions::Depth::png) {
            // One unit for all frames, with room for things that go away from the camera.
            if (2 * farthest > unit_ * 65535) unit_ = 2 * farthest / 65535;
            json_["integer_depth_scale"] = unit_;
            job_.note(fmt::format("depth is rounded to steps of {:.3g} scene units", unit_));
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
        if (index > 0 && samePictures(view, track.before)) return {};
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
    Bundle first_;  ///< names and cameras
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
