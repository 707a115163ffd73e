#include "tools/extract_shown.hpp"

#include <nlohmann/json.hpp>

#include "formats/any/open.hpp"
#include "formats/any/sequences.hpp"
#include "formats/atlas/atlas_files.hpp"
#include "formats/files/file_spool.hpp"
#include "formats/files/files.hpp"
#include "formats/files/no_case.hpp"
#include "formats/viewer/surfaces_glb.hpp"
#include "formats/viewer/viewer_page.hpp"
#include "lib/base/stopwatch.hpp"
#include "lib/model/from_origin.hpp"
#include "lib/model/peak_memory.hpp"
#include "lib/model/view_table.hpp"
#include "lib/refine/refine_needed.hpp"
#include "lib/render/surface/view_surfaces.hpp"
#include "tools/camera_options.hpp"
#include "tools/peak_of_views.hpp"
#include "tools/picture_times.hpp"
#include "tools/refining.hpp"

namespace stx::tools {
namespace {

/// What was written, for the last line and the report.
struct Shown {
    std::string what;
    std::size_t views = 0;
    std::int64_t points = 0;
};

/// Whether a page shows an input as it is in an atlas: one of which nothing is to be refined.
Result<bool> showsItsTextures(const std::string& input, const OpenOptions& open,
                              const RefineSettings& settings, Job& job) {
    STX_TRY(const auto kind, recognise(input));
    if (kind != FileKind::atlas || !settings.any()) return kind == FileKind::atlas;
    Job quiet;  // it is read again, by what says what there is to say
    quiet.workFor(job);
    STX_TRY(auto frames, openSequence(input, open, quiet));
    frames = fromOrigin(std::move(frames));
    STX_TRY(const auto views, frames->views(0, quiet));
    STX_TRY(const bool needed, mayRefine(*views, settings, quiet));
    return !needed;
}

/// A page for browsers, of an atlas' own textures where it may be.
Result<Shown> writePage(const std::string& input, const OpenOptions& open,
                        const std::string& output, const std::string& refine, int jpegQuality,
                        Program& program) {
    PageOptions write;
    write.colours = {jpegQuality, open.keepColourFiles};
    // Without its folder: pages of the same input are the same wherever it lies.
    const std::filesystem::path path(input);
    write.input = (path.has_filename() ? path : path.parent_path()).filename().string();
    if (!open.object.empty()) write.renderOptions = {"--object", open.object};
    if (refine != "auto") {
        write.renderOptions.push_back("--refine");
        write.renderOptions.push_back(refine);
    }
    write.output = program.outputOptions();
    STX_TRY(const auto settings, refineSettings(refine));
    STX_TRY(const bool itself, showsItsTextures(input, open, settings, program.job));
    Result<PageReport> page = PageReport();
    if (itself) {
        STX_TRY(auto atlas, openAtlas(input, open, program.job));
        countFromOrigin(atlas);
        page = writeViewerPage(atlas, output, write, program.job);
    } else {
        STX_TRY(auto frames, openSequence(input, open, program.job));
        frames = fromOrigin(std::move(frames));
        STX_TRY(frames, refined(std::move(frames), refine, peak::kPage, folderBeside(output)));
        page = writeViewerPage(*frames, output, write, program.job);
    }
    if (!page) return propagate(page);
    return Shown{page->frames > 1 ? fmt::format("{} of {}", counted(page->frames, "frame"),
                                                counted(page->views, "view"))
                                  : counted(page->views, "view"),
                 page->views, page->points};
}

/// The views of a model, refined; in a spool, which is made then, where they would take more memory
/// than there may be.
Result<Bundle> viewsOfModel(std::unique_ptr<ViewTable> table, const RefineSettings& settings,
                            const SurfacesOptions& options, const std::filesystem::path& output,
                            std::unique_ptr<FileSpool>& spool, Job& job) {
    const bool fewer = options.mostTriangles > 0;
    const PeakMemory& takes = fewer ? peak::kFewerTriangles : peak::kSurfaces;
    const std::uint64_t limit = job.limits.maxMemoryBytes;
    if (!fewer && !table->whole() && memoryOfAll(*table, takes) > limit &&
        memoryOfSpooledSurfaces(*table) <= limit) {
        STX_TRY(const bool needed, mayRefine(*table, settings, job));
        STX_TRY(spool, FileSpool::create(folderBeside(output), limit / kSpoolPart));
        STX_TRY(auto bundle, wholeBundle(*table, *spool, job));
        if (needed) STX_CHECK(refineViews(bundle, settings, *spool, job));
        return bundle;
    }
    STX_CHECK(checkImagesFit(takes, *table, job.limits,
                             fewer ? UINT64_MAX : memoryOfSpooledSurfaces(*table)));
    STX_TRY(auto bundle, wholeBundle(std::move(table), job));
    STX_CHECK(refineViews(bundle, settings, takes, job));
    return bundle;
}

/// A model of one moment.
Result<Shown> writeModel(const std::string& input, const OpenOptions& open,
                         const std::string& output, const std::optional<double>& time,
                         const std::string& refine, const SurfacesOptions& options,
                         Program& program) {
    STX_TRY(const auto settings, refineSettings(refine));
    STX_TRY(auto frames, openSequence(input, open, program.job));
    frames = fromOrigin(std::move(frames));
    STX_TRY(const auto moment,
            momentOf(time, frames->timeline(), "a model is", input, program.job));
    STX_TRY(auto table, frames->views(moment, program.job));
    std::unique_ptr<FileSpool> spool;  // outlives its bundle
    STX_TRY(auto bundle,
            viewsOfModel(std::move(table), settings, options, output, spool, program.job));
    Shown out{"", bundle.views.size(), bundle.pointCount()};
    SurfacesOptions write = options;
    write.spool = spool.get();
    STX_TRY(const auto report, writeSurfaces(output, std::move(bundle), write, program.job));
    out.what = counted(report.views, "view") + ", " +
               counted(static_cast<std::size_t>(report.triangles), "triangle");
    if (report.points > 0)
        out.what += ", " + counted(static_cast<std::size_t>(report.points), "point");
    return out;
}

/// The notes, the last line and the report.
Result<int> finish(const std::string& input, const std::string& output, const Shown& done,
                   double seconds, Program& program) {
    program.sayNotes();
    program.say(fmt::format("{} ({}) → {} ({}), {}, {}",
                            std::filesystem::path(input).filename().string(),
                            humanBytes(bytesOf(input)), output, humanBytes(bytesOf(output)),
                            done.what, humanSeconds(seconds)));
    STX_CHECK(program.writeReport({{"$schema", "extract-report.schema.json"},
                                   {"input", input},
                                   {"output", output},
                                   {"views", done.views},
                                   {"points", done.points},
                                   {"seconds", seconds}}));
    return 0;
}

}  // namespace

bool isShown(const std::string& ending) {
    return ending == ".html" || ending == ".glb";
}

Result<int> extractShown(const std::string& input, const OpenOptions& open,
                         const std::string& output, const std::optional<double>& time,
                         const std::string& refine, const SurfacesOptions& model,
                         Program& program) {
    const Stopwatch watch;
    SurfacesOptions written = model;
    written.output = program.outputOptions();
    STX_TRY(const Shown done,
            lowerExtension(output) == ".glb"
                ? writeModel(input, open, output, time, refine, written, program)
                : writePage(input, open, output, refine, model.jpegQuality, program));
    return finish(input, output, done, watch.seconds(), program);
}

Result<int> extractPicture(const std::string& input, const OpenOptions& open,
                           const std::string& output, DepthPicture kind, int jpegQuality, int view,
                           const std::optional<double>& time, const std::string& refine,
                           Program& program) {
    const Stopwatch watch;
    if (kind == DepthPicture::pair) STX_CHECK(checkTarget(depthFileOf(output), program));
    STX_TRY(auto frames, openSequence(input, open, program.job));
    STX_TRY(frames, refined(std::move(frames), refine, peak::kExport, folderBeside(output)));
    STX_TRY(const auto moment,
            momentOf(time, frames->timeline(), "a picture is", input, program.job));
    STX_TRY(const auto table, frames->views(moment, program.job));
    noteEnvironmentLeftOut(std::as_const(*table).about().environment, program.job);
    noteMaterialLeftOut(*table, program.job);
    STX_TRY(const std::size_t number, namedView(view, std::as_const(*table).about().views));
    const std::uint64_t pixels = table->pixelsOf(number);
    STX_CHECK(checkPeak(peak::kExport, pixels, pixels,
                        table->bytesHeld() + table->bytesToMake(number), program.job.limits));
    STX_TRY(const auto read, table->view(number, program.job));
    const ReferenceView& shown = *read;
    STX_CHECK(
        exportPicture(shown, output, kind, jpegQuality, program.outputOptions(), program.job));
    const std::string what = fmt::format(
        "view {} '{}', {}x{}{}", number, shown.name, shown.depth.width(), shown.depth.height(),
        kind == DepthPicture::pair
            ? fmt::format(" and its depth, {}", depthFileOf(output).filename().string())
            : " beside its depth");
    return finish(input, output, {what, 1, shown.pointCount()}, watch.seconds(), program);
}

}  // namespace stx::tools
