#include "formats/imagesets/summary.hpp"

#include <unordered_set>

#include "formats/imagesets/kinds.hpp"
#include "formats/imagesets/motion.hpp"
#include "formats/imagesets/pictures.hpp"

namespace stx {

using namespace imagesets;

Result<ImageSetSummary> summariseImageSet(const std::filesystem::path& path, Job& job) {
    ImageSetSummary summary;
    ImageSetOptions options;
    STX_TRY(options.from, recogniseImageSet(path));
    summary.kind = options.from;
    // Depth is not read: its range has no effect here.
    if (summary.kind == "msr") {
        options.depthMin = 1;
        options.depthMax = 2;
    }
    auto described = describeSet(path, options, job);
    if (!described && described.error().code == ErrorCode::usage && summary.kind == "photo") {
        job.note(fmt::format("{}; white is taken for it here", described.error().text()));
        options.photo.nearIs = NearIs::white;
        described = describeSet(path, options, job);
    }
    if (!described && described.error().code == ErrorCode::usage) {
        job.note(fmt::format("cameras are not known: {}", described.error().text()));
        summary.camerasKnown = false;
        if (summary.kind == "middlebury") options.focal = options.baseline = 1;
        described = describeSet(path, options, job);
    }
    if (!described) return propagate(described);
    summary.title = std::move(described->title);
    summary.photo = described->photo;
    summary.cameraFrom = described->cameraFrom;
    STX_TRY(const Motion motion, motionOf(*described, options));
    summary.frames = motion.moves() ? static_cast<int>(motion.times.size()) : described->frames;
    if (motion.moves())
        summary.timeline = motion.timeline();
    else if (described->frames > 1)
        summary.timeline = steadyTimeline(described->frames, described->rate);
    std::unordered_set<std::size_t> first;
    for (const Motion::Track& track : motion.tracks)
        if (const auto picture = motion.pictureAt(*described, track, 0)) first.insert(*picture);
    std::unordered_set<std::string> counted;
    for (const SetView& view : described->views) {
        ImageSetSummary::View out;
        out.name = view.name;
        out.camera = view.camera;
        out.lost = view.lost;
        out.panorama = view.panorama.has_value();
        out.video = view.texture.film || view.depth.film;
        out.later = motion.moves() && !first.contains(summary.views.size());
        out.colour = view.texture.name;
        out.depth = view.depth.name;
        for (const PictureSource* source : {&view.texture, &view.depth}) {
            std::error_code ec;
            if (source->missing) {
                out.missing.push_back(source->name);
            } else if (!source->path.empty() && counted.insert(source->path.native()).second) {
                if (const auto size = std::filesystem::file_size(source->path, ec); !ec)
                    summary.bytes += size;
            }
        }
        // Blender's files have an angle only.
        if (out.camera.width == 0 && !view.texture.missing && !view.texture.path.empty()) {
            if (const auto size = imageSizeOf(view.texture, job)) out.camera = view.cameraOf(*size);
        }
        summary.views.push_back(std::move(out));
    }
    return summary;
}

}  // namespace stx
