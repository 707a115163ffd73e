#include "formats/any/save.hpp"

#include <algorithm>
#include <functional>

#include "formats/exr/bundle_exr.hpp"
#include "formats/files/no_case.hpp"
#include "formats/mpeg4/mpeg4.hpp"
#include "lib/refine/refine_needed.hpp"
#include "lib/render/factory.hpp"

namespace stx {

namespace fs = std::filesystem;

namespace {

using Summarise = std::function<ViewSummary(const ReferenceView& view)>;

/// Whether one view and what making its summary takes are within the limit.
bool hasRoomForSummaries(const ViewTable& table, const Limits& limits) {
    std::uint64_t most = 0;
    for (std::size_t i = 0; i < table.count(); ++i)
        most = std::max({most, table.bytesToMake(i),
                         table.bytesGiven(i) + peak::kSummary.perPixel * table.pixelsOf(i)});
    return table.bytesHeld() + most <= limits.maxMemoryBytes;
}

/// What makes the summaries of views, none where they would tell nothing: see SaveOptions. Errors:
/// cancelled.
Result<Summarise> summariesFor(const ViewTable& table, SaveOptions::Summaries wanted, Job& job) {
    if (wanted == SaveOptions::Summaries::none || !tellWithoutPixels(table.about().views))
        return Summarise();
    // Next to a limit of the memory a file without summaries is better than none.
    if (!hasRoomForSummaries(table, job.limits)) return Summarise();
    if (wanted == SaveOptions::Summaries::ofExact && table.summaries().empty()) {
        const auto needed = mayRefine(table, RefineSettings(), job);
        STX_CHECK(job.checkCancelled());
        // What is wrong with a view shows when it is written.
        if (!needed || *needed) return Summarise();
    }
    return Summarise(summaryOfView);
}

}  // namespace

Result<FileKind> containerOf(const fs::path& target) {
    const std::string ending = lowerExtension(target);
    if (ending == ".exr") return FileKind::exr;
    if (mpeg4ContainerOf(target)) return FileKind::mpeg4;
    return fail(ErrorCode::usage,
                "'{}' ends in '{}'; a bundle is written as .exr, .mp4, .xmt or .bt",
                target.string(), ending);
}

Result<void> saveBundle(const Bundle& bundle, const fs::path& target, const SaveOptions& options,
                        Job& job) {
    return saveViews(*viewsOf(bundle), target, options, job);
}

Result<void> saveViews(const ViewTable& table, const fs::path& target, const SaveOptions& options,
                       Job& job, OutputFiles* together) {
    // Both writers check the bundle: see Bundle::check().
    STX_TRY(const auto container, containerOf(target));
    if (container == FileKind::exr && options.octreeLevels > 0)
        return fail(ErrorCode::usage, "'{}': an OctreeImage is written as .mp4, .xmt or .bt only",
                    target.string());
    if (container == FileKind::exr && options.pointTexture)
        return fail(ErrorCode::usage, "'{}': PointTextures are written as .mp4, .xmt or .bt only",
                    target.string());
    if (container == FileKind::exr && options.jpegQuality != 0)
        return fail(ErrorCode::usage,
                    "'{}': JPEG is of MPEG-4 containers; .exr keeps colours as they are",
                    target.string());
    if (container == FileKind::exr && options.h264 >= 0)
        return fail(ErrorCode::usage,
                    "'{}': video is of MPEG-4 containers; .exr keeps colours as they are",
                    target.string());
    if (container == FileKind::exr) {
        STX_TRY(const auto summarise, summariesFor(table, options.summaries, job));
        return writeExrViews(table, target, job, {options.noClobber, together}, summarise);
    }
    return writeMpeg4Views(table, target, job, mpeg4Scene(options), mpeg4Write(options));
}

mpeg4::SceneWriteOptions mpeg4Scene(const SaveOptions& options) {
    mpeg4::SceneWriteOptions scene;
    if (options.jpegQuality != 0) {
        scene.texture = mpeg4::SceneWriteOptions::Texture::jpeg;
        scene.jpegQuality = options.jpegQuality;
    }
    scene.pointTexture = options.pointTexture;
    scene.octreeLevels = options.octreeLevels;
    scene.h264 = options.h264;
    return scene;
}

Mpeg4WriteOptions mpeg4Write(const SaveOptions& options) {
    Mpeg4WriteOptions write;
    write.output.noClobber = options.noClobber;
    write.bifsVersion = options.bifsVersion;
    return write;
}

Result<std::optional<Bundle>> convertDocument(const fs::path& input, const fs::path& target,
                                              const SaveOptions& options, bool changesDepth,
                                              bool pixels, Job& job) {
    STX_TRY(const auto from, recognise(input));
    STX_TRY(const auto to, containerOf(target));
    if (from != FileKind::mpeg4 || to != FileKind::mpeg4 || changesDepth ||
        options.jpegQuality != 0 || options.h264 >= 0 || options.pointTexture ||
        options.octreeLevels > 0)
        return std::nullopt;
    STX_TRY(const auto document, readMpeg4(input, job));
    STX_CHECK(writeMpeg4(document, target, job, mpeg4Write(options)));
    // A presentation need not be a bundle to be converted, so what is wrong with its views is
    // neither an error nor a note here.
    Job quiet;
    quiet.limits = job.limits;
    mpeg4::SceneReadOptions read;
    read.folder = folderOf(input);
    read.pixels = pixels;
    auto bundle = mpeg4::bundleFromScene(document, read, quiet);
    return bundle ? std::move(*bundle) : Bundle();
}

}  // namespace stx
