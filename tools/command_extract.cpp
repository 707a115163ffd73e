#include <algorithm>
#include <atomic>
#include <utility>

#include <nlohmann/json.hpp>

#include "formats/any/sequences.hpp"
#include "formats/files/files.hpp"
#include "formats/files/no_case.hpp"
#include "formats/images/images.hpp"
#include "formats/imagesets/export.hpp"
#include "formats/meshes/meshes.hpp"
#include "formats/viewer/viewer_page.hpp"
#include "lib/base/parallel.hpp"
#include "lib/base/stopwatch.hpp"
#include "lib/model/from_origin.hpp"
#include "lib/model/peak_memory.hpp"
#include "lib/model/translucent.hpp"
#include "lib/model/view_table.hpp"
#include "tools/commands.hpp"
#include "tools/extract_shown.hpp"
#include "tools/extract_splats.hpp"
#include "tools/picture_times.hpp"
#include "tools/refining.hpp"
#include "tools/view_tally.hpp"

namespace stx::tools {
namespace {

struct ExtractOptions {
    std::string input, output;
    std::string cameras = "transforms";
    ExportOptions::Depth depth = ExportOptions::Depth::exr;
    std::string refine = "auto";
    std::optional<double> time;
    PointWriteOptions points;
    std::string as;
    int view = -1;
    int triangles = 0;
    std::string colour;
    std::optional<int> quality;
    int mostSplats = 0;
    double pixelsPerTexel = SplatSettings{}.pixelsPerTexel;
    OpenOptions open;
};

/// Points as flat arrays.
struct Points {
    std::vector<glm::vec3> positions, normals;
    std::vector<glm::u8vec4> colours;

    /// Those of a view, row by row.
    void add(const ReferenceView& view, bool withNormals);
    [[nodiscard]] PointCloud cloud(const glm::dvec3& origin) const {
        PointCloud out;
        out.positions = positions;
        out.colours = colours;
        out.normals = normals;
        out.origin = origin;
        return out;
    }
};

glm::u8vec4 codedColour(const Texture& texture, int x, int y) {
    if (const auto* image = texture.rgba8()) return image->at(x, y);
    const glm::vec4 c = texture.at(x, y);
    const auto coded = [](float v) {
        return static_cast<std::uint8_t>(glm::clamp(srgbFromLinear(v), 0.0f, 1.0f) * 255.0f + 0.5f);
    };
    return {coded(c.x), coded(c.y), coded(c.z), 255};
}

void Points::add(const ReferenceView& view, bool withNormals) {
    for (int y = 0; y < view.depth.height(); ++y) {
        for (int x = 0; x < view.depth.width(); ++x) {
            if (!hasPoint(view.depth.at(x, y))) continue;
            positions.emplace_back(view.worldPoint(x, y));
            auto colour = codedColour(view.texture, x, y);
            colour.w = 255;
            colours.push_back(colour);
            if (withNormals) normals.push_back(view.normal.at(x, y));
        }
    }
}

/// How many points views have. Where their file does not say it, they are read for that.
Result<std::size_t> countPoints(const ViewTable& table, Job& job) {
    std::vector<std::int64_t> points(table.count());
    if (const auto summaries = table.summaries(); !summaries.empty()) {
        std::ranges::transform(summaries, points.begin(), &ViewSummary::points);
    } else {
        // What there is to say is said when they are read again.
        Job quiet;
        quiet.workFor(job);
        STX_CHECK(forEachView(
            table, {"points", 0}, quiet,
            [&](std::size_t i, const std::shared_ptr<const ReferenceView>& view) -> Result<void> {
                points[i] = view->pointCount();
                return {};
            }));
    }
    std::size_t all = 0;
    for (const std::int64_t n : points)
        all += static_cast<std::size_t>(std::max<std::int64_t>(n, 0));
    return all;
}

/// Who asks for fewer triangles wants a small file, and has given up the exact one.
SurfacesOptions modelOf(const ExtractOptions& o) {
    const bool jpeg = o.colour.empty() ? o.triangles > 0 : o.colour == "jpeg";
    return {.mostTriangles = static_cast<std::size_t>(o.triangles),
            .jpegQuality = jpeg ? o.quality.value_or(kJpegQuality) : 0};
}

/// What is written.
struct Wanted {
    std::optional<ExtractAs> as;  ///< nothing: a folder or a page
    std::string ending;           ///< of a file, in small letters
    bool splats = false, points = false, picture = false;
    bool shown = false;  ///< a file that others show
};

/// What the options ask for; puts the name of a folder right. Errors (usage): those of
/// folderTarget() and extractedAs().
Result<Wanted> wantedOf(ExtractOptions& o) {
    STX_TRY(
        const auto target,
        folderTarget(o.output, {".glb", ".html", ".ply", ".drc", ".spz", ".png", ".jpg", ".jpeg"},
                     "a folder, .glb, .html, .ply, .spz, .drc, .png or .jpg"));
    o.output = target.path;
    Wanted w;
    STX_TRY(w.as, extractedAs(o.as, target.folder ? "" : o.output));
    if (!target.folder) w.ending = lowerExtension(o.output);
    w.splats = w.as == ExtractAs::splats;
    w.points = w.as == ExtractAs::points;
    w.picture = w.as == ExtractAs::rgbd || w.as == ExtractAs::pair;
    w.shown = isShown(w.ending) && !w.splats;
    return w;
}

/// Errors (usage) for options that cannot matter to what is written.
Result<void> checkOptions(const ExtractOptions& o, const Wanted& w, const Command& command) {
    const bool model = w.as == ExtractAs::surfaces, page = w.ending == ".html";
    if (!model) STX_CHECK(command.refuse({"--triangles"}, "is of a model of surfaces, .glb"));
    if (w.as && !model)
        STX_CHECK(command.refuse({"--colour"}, "is of a folder, of .html and of surfaces (.glb)"));
    if (o.colour == (model || page ? "exr" : "jpeg"))
        STX_CHECK(command.refuse(
            {"--colour"},
            o.colour + (model || page ? " is of a folder" : " is of .html and .glb")));
    if (o.cameras == "colmap")
        STX_CHECK(command.refuse({"--colour"},
                                 "does not go with --cameras colmap, whose colour is 8-bit PNG"));
    const bool jpeg = w.picture ? w.ending != ".png" : modelOf(o).jpegQuality > 0;
    if (!jpeg) STX_CHECK(command.refuse({"--quality"}, "is of JPEG"));
    if (!w.picture) STX_CHECK(command.refuse({"--view"}, "is of a picture with depth"));
    if (w.shown || w.picture || w.splats || w.points)
        STX_CHECK(command.refuse({"--cameras", "--depth"},
                                 fmt::format("is of a folder; -o {} is a file{}", o.output,
                                             w.splats   ? " of splats"
                                             : w.points ? " of points"
                                                        : "")));
    if (!w.splats)
        STX_CHECK(command.refuse({"--max-splats", "--pixels-per-texel"},
                                 "is of splats; give --as splats, too"));
    if (w.ending == ".html")
        STX_CHECK(command.refuse({"--time"}, "is of what shows one moment; a page plays the film"));
    if (o.cameras == "colmap")
        STX_CHECK(command.refuse({"--depth"},
                                 "does not go with --cameras colmap, whose depth is floats"));
    if (!(w.points && w.ending == ".drc"))
        STX_CHECK(command.refuse({"--position-bits", "--normal-bits"}, "is of .drc files"));
    return {};
}

/// What was written: "7 views of 3 frames".
struct Extracted {
    std::string what;
    std::size_t views = 0;
    std::int64_t points = 0;
};

/// What the points of views lose in a file.
struct PointLosses {
    std::atomic<bool> translucent = false, linear = false, beyondWhite = false;

    void look(const ReferenceView& view) {
        if (hasTranslucentInside(view.texture, view.depth)) translucent = true;
        if (view.texture.isLinear()) linear = true;
        if (isBeyondWhite(view.texture)) beyondWhite = true;
    }
    void note(Job& job) const {
        if (translucent) job.note("points of translucent surfaces are opaque in the file");
        Rgba8Loss{.linear = linear, .clipped = beyondWhite}.note(job);
    }
};

/// A .ply, view by view.
Result<Extracted> extractPly(const ExtractOptions& o, const PeakMemory& takes, Sequence& frames,
                             std::size_t moment, Program& program) {
    STX_TRY(const auto table, frames.views(moment, program.job));
    const bool normals = allHaveNormals(*table, program.job);
    const glm::dvec3 origin = std::as_const(*table).about().origin;
    noteEnvironmentLeftOut(std::as_const(*table).about().environment, program.job);
    noteMaterialLeftOut(*table, program.job);
    keepFreedMemory();  // of a view, for the next one
    STX_TRY(const std::size_t count, countPoints(*table, program.job));
    STX_TRY(auto file, PlyInParts::create(o.output, {count, normals, true, false, origin},
                                          program.outputOptions()));
    std::vector<Bytes> rows(table->count());
    PointLosses losses;
    const auto encode = [&](std::size_t i,
                            const std::shared_ptr<const ReferenceView>& view) -> Result<void> {
        Points points;
        points.add(*view, normals);
        losses.look(*view);
        STX_TRY(rows[i], file.encode(points.cloud(origin)));
        return {};
    };
    const auto add = [&](std::size_t i) -> Result<void> {
        return file.add(std::exchange(rows[i], Bytes()));
    };
    STX_CHECK(forEachView(*table, takes, program.job, encode, add));
    STX_CHECK(file.commit());
    losses.note(program.job);
    return Extracted{counted(count, "point"), table->count(), static_cast<std::int64_t>(count)};
}

Result<Extracted> extractPoints(const ExtractOptions& o, const PeakMemory& takes, Sequence& frames,
                                std::size_t moment, Program& program) {
    STX_TRY(const auto bundle, frames.frame(moment, program.job));
    STX_CHECK(checkPeak(takes, bundle.views, program.job.limits));
    noteEnvironmentLeftOut(bundle.environment, program.job);
    bundle.noteMaterialLeftOut(program.job);
    const bool normals = allHaveNormals(*viewsOf(bundle), program.job);
    Points found;
    PointLosses losses;
    for (const ReferenceView& view : bundle.views) {
        found.add(view, normals);
        losses.look(view);
    }
    losses.note(program.job);
    PointWriteOptions write = o.points;
    write.file.noClobber = program.common.noClobber;
    STX_CHECK(writePoints(o.output, found.cloud(bundle.origin), program.job, write));
    return Extracted{counted(found.positions.size(), "point"), bundle.views.size(),
                     bundle.pointCount()};
}

Result<Extracted> extractFolder(const ExtractOptions& o, std::unique_ptr<Sequence> frames,
                                std::size_t moment, Program& program) {
    ExportOptions write;
    write.kind = o.cameras == "miv"      ? ExportOptions::Kind::miv
                 : o.cameras == "colmap" ? ExportOptions::Kind::colmap
                                         : ExportOptions::Kind::transforms;
    write.noClobber = program.common.noClobber;
    write.depth = o.depth;
    write.linearAsPng = o.colour == "png";
    if (frames->timeline().moves() && o.time)
        STX_SET(frames, someFrames(std::move(frames), {moment}));
    const std::size_t count = frames->timeline().count();
    keepFreedMemory();  // of a view, for the next one
    ViewTally tally;
    frames = tallied(std::move(frames), tally);
    STX_CHECK(exportFrames(*frames, o.output, write, program.job));
    Extracted out{counted(tally.views(), "view"), tally.views(), tally.points()};
    if (count > 1) out.what += " of " + counted(count, "frame");
    return out;
}

Result<int> extract(const ExtractOptions& options, const Command& command, Program& program) {
    const Stopwatch watch;
    ExtractOptions o = options;
    STX_TRY(const Wanted wanted, wantedOf(o));
    STX_CHECK(checkOptions(o, wanted, command));
    STX_CHECK(checkTarget(o.output, program));
    preloadCodecs(o.input);
    if (wanted.splats)
        return extractSplats(
            o.input, o.open, o.output, o.time, o.refine,
            {.pixelsPerTexel = o.pixelsPerTexel, .most = static_cast<std::size_t>(o.mostSplats)},
            program);
    if (wanted.picture)
        return extractPicture(
            o.input, o.open, o.output,
            wanted.as == ExtractAs::pair ? DepthPicture::pair : DepthPicture::sideBySide,
            o.quality.value_or(kJpegQuality), o.view, o.time, o.refine, program);
    // As exact as PNG for what is JPEG already, and smaller than to code it again.
    o.open.keepColourFiles = wanted.ending == ".html" && o.colour != "png" && !o.quality;
    if (wanted.shown)
        return extractShown(o.input, o.open, o.output, o.time, o.refine, modelOf(o), program);
    // Other programs' workspaces have pictures of 8 bits.
    o.open.set.deepColour = !wanted.points && o.cameras == "transforms";
    const PeakMemory& takes = !wanted.points            ? peak::kExport
                              : wanted.ending == ".drc" ? peak::kPointsDraco
                                                        : peak::kPoints;
    STX_TRY(auto frames, openSequence(o.input, o.open, program.job));
    if (wanted.points) frames = fromOrigin(std::move(frames));
    STX_TRY(frames, refined(std::move(frames), o.refine, takes, folderBeside(o.output)));
    STX_TRY(const std::size_t moment,
            momentOf(o.time, frames->timeline(), wanted.points ? "points are" : nullptr, o.input,
                     program.job));
    Extracted out;
    if (wanted.points)
        STX_SET(out, (wanted.ending == ".ply" ? extractPly : extractPoints)(o, takes, *frames,
                                                                            moment, program));
    else
        STX_SET(out, extractFolder(o, std::move(frames), moment, program));
    const double seconds = watch.seconds();
    program.sayNotes();
    program.say(fmt::format("{} ({}) → {} ({}), {}, {}",
                            std::filesystem::path(o.input).filename().string(),
                            humanBytes(bytesOf(o.input)), o.output, humanBytes(bytesOf(o.output)),
                            out.what, humanSeconds(seconds)));
    STX_CHECK(program.writeReport({{"$schema", "extract-report.schema.json"},
                                   {"input", o.input},
                                   {"output", o.output},
                                   {"views", out.views},
                                   {"points", out.points},
                                   {"seconds", seconds}}));
    return 0;
}

constexpr const char* kAbout =
    "Images and cameras of a bundle as plain files, its points as .ply or .drc, Gaussian "
    "splats, a model of surfaces, a picture with depth, or a page that draws it in any "
    "browser\n\n"
    "  stx extract model.mp4 -o folder           transforms.json and PNGs\n"
    "  stx extract model.mp4 -o folder --cameras miv\n"
    "  stx extract film.mp4 -o folder            all frames, with their times\n"
    "  stx extract model.mp4 -o points.ply\n"
    "  stx extract model.mp4 -o cloud.ply --as splats    for any viewer of Gaussian splats\n"
    "  stx extract film.mp4 -o film_%04d.spz             a file of splats for each frame\n"
    "  stx extract model.mp4 -o model.glb        surfaces with textures, for any glTF viewer\n"
    "  stx extract model.mp4 -o view.html        one file for browsers (WebGL 2)\n"
    "  stx extract photo.mp4 -o photo.glb --triangles 200000\n"
    "  stx extract photo.mp4 -o photo_rgbd.png   colour beside depth, white near\n"
    "  stx extract photo.mp4 -o photo.jpg        and its depth in photo_depth.jpg\n\n"
    "The page is turned by dragging, by keys and by touch, under a light that moves, and "
    "plays\nfilms. Its address takes a camera: "
    "view.html#eye=0,1,3&target=0,0,0&fov=40, time, light and more. Where --max-memory has no "
    "room for all views "
    "at\nonce, the page has more textures: it draws the same, in other bytes.";

}  // namespace

void addExtract(CommandLine& line, Program& program) {
    Command c = line.add("extract", kAbout);
    auto o = std::make_shared<ExtractOptions>();
    c.option("BUNDLE", o->input, "Bundle, film or atlas").required();
    c.option("-o,--output", o->output,
             "Folder, points.ply, points.drc, cloud.spz, model.glb, view.html, or a picture with "
             "depth: NAME.jpg, NAME_rgbd.png")
        .required()
        .writes("OUT");
    c.option(
         "--cameras", o->cameras,
         "Camera file in the folder: transforms (nerfstudio), miv, or colmap (a dense workspace) "
         "(default transforms)")
        .oneOf({"transforms", "miv", "colmap"});
    using Depth = ExportOptions::Depth;
    c.choice<Depth>("--depth", o->depth,
                    {{"exr", Depth::exr}, {"png", Depth::png}, {"npy", Depth::npy}},
                    "In the folder: exr (floats, exact), png (16 bits, rounded) or npy (NumPy's "
                    "floats, exact) (default exr). The channel of .exr is Z, which OpenCV 4.6 "
                    "reads as zeros: take npy or png for it");
    c.option("--time", o->time, "Of a film: the moment, in seconds by its own clock (default: all)")
        .takes("T");
    refineOption(c, o->refine);
    c.option("--as", o->as,
             "What a file holds: points (.ply, .drc), splats (.ply, .spz, .glb), surfaces (.glb), "
             "rgbd (.png, .jpg: colour on the left, depth on the right) or pair (colour, and depth "
             "in NAME_depth.png or NAME_depth.jpg) (default: .ply and .drc points, .spz splats, "
             ".glb surfaces, "
             "NAME_rgbd.png rgbd, other pictures pair). Depth of pictures is white near")
        .oneOf({"points", "splats", "surfaces", "rgbd", "pair"});
    c.option("--view", o->view, "Of a picture with depth: reference view K (default: the first)")
        .takes("K")
        .notNegative();
    c.option("--max-splats", o->mostSplats,
             "At most so many splats: flat pieces of one colour become larger ones (default: one "
             "for each point; a pruned atlas has each place once)")
        .range(1, 2000000000)
        .takes("N");
    c.option("--pixels-per-texel", o->pixelsPerTexel,
             "Of splats: how many pixels wide a texel is in the pictures that they are for; their "
             "outlines are right there, thinner in larger pictures and thicker in smaller ones "
             "(default 1.5)")
        .range(0.1, 100.0)
        .takes("N");
    c.option("--triangles", o->triangles,
             "Of surfaces (.glb): at most about so many triangles; what is least seen from beside "
             "the views goes first (default: all)")
        .range(1, 2000000000)
        .takes("N");
    c.option(
         "--colour", o->colour,
         "Of .html and of surfaces (.glb): png (exact) or jpeg; .html copies the JPEG pictures of "
         "an input that has such, unless png or --quality is given. In the folder, of colours in "
         "linear light and of 16 bits: exr (exact) or png (16-bit sRGB, exact for what was that) "
         "(default: of .html and surfaces png, with --triangles jpeg; in the folder exr)")
        .oneOf({"png", "jpeg", "exr"});
    c.option("--quality", o->quality, "Of JPEG (default 92)").range(1, 100);
    c.option("--position-bits", o->points.positionBits, "Of .drc, 0 = exact floats").range(0, 30);
    c.option("--normal-bits", o->points.normalBits, "Of .drc, 0 = exact floats").zeroOrRange(2, 30);
    c.objectOption(o->open.object);
    c.sharedOptions(program.common, kOutput | kOutside | kPictures);
    c.runs([o, c](Program& p) { return extract(*o, c, p); });
}

}  // namespace stx::tools
