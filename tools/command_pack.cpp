#include <algorithm>
#include <cmath>
#include <map>

#include <nlohmann/json.hpp>

#include "formats/any/sequences.hpp"
#include "formats/atlas/atlas_files.hpp"
#include "formats/files/files.hpp"
#include "formats/files/numbered.hpp"
#include "formats/images/images.hpp"
#include "lib/base/stopwatch.hpp"
#include "lib/packing/packing.hpp"
#include "lib/packing/period.hpp"
#include "lib/packing/views_one_by_one.hpp"
#include "lib/quality/prune_quality.hpp"
#include "tools/batch.hpp"
#include "tools/commands.hpp"
#include "tools/picture_times.hpp"
#include "tools/refining.hpp"

namespace stx::tools {
namespace {

/// Of views in memory; pages are a little larger, by their padding.
constexpr PeakMemory kPacking = {peak::kAtlas.what, peak::kAtlas.perPixel + 4};

struct PackOptions {
    std::vector<std::string> inputs;
    std::string input, output;     ///< of one
    std::uint64_t inputBytes = 0;  ///< before the output takes its place
    std::vector<std::string> names;
    std::string size;
    OpenOptions open;
    std::string refine = "auto";
    PackSettings settings;
    bool prune = false;
    std::string budget;
    PruneSettings pruning;
    std::optional<double> minPsnr;
    std::optional<double> time;
    int period = 25;  ///< as the groups of pictures of video
    std::string colour = "png";
    std::optional<int> quality;
    AtlasSaveOptions save;
};

/// How an input is opened for what is written.
OpenOptions openOptions(const PackOptions& o) {
    return o.save.folder ? o.open : o.open.into(o.output);
}

/// "4M", "250k" or "1000000" pixels.
Result<std::int64_t> parsePixels(const std::string& text) {
    std::string number = text;
    double factor = 1;
    if (!number.empty() && (number.back() == 'M' || number.back() == 'k')) {
        factor = number.back() == 'M' ? 1e6 : 1e3;
        number.pop_back();
    }
    const auto value = parseNumbers(number, 1, "--budget");
    if (!value || (*value)[0] * factor < 1 || (*value)[0] * factor > 1e15)
        return fail(ErrorCode::usage,
                    "--budget is '{}'; a number of pixels is expected, as in 4M or 250k", text);
    return static_cast<std::int64_t>((*value)[0] * factor);
}

/// --size: of pages.
Result<void> setSize(const std::string& text, const Limits& limits, PackSettings& settings) {
    settings.powerOfTwo = text == "power-of-two";
    if (text.empty() || settings.powerOfTwo) return {};
    if (text.find_first_of("xX") == std::string::npos)
        return fail(ErrorCode::usage,
                    "--size is '{}'; WIDTHxHEIGHT is expected, as in 2048x2048, or power-of-two",
                    text);
    STX_TRY(settings.size, parseSize(text, limits));
    return {};
}

/// Packs so that the images that are written, not only the pages, are within settings.maxSize.
Result<Atlas> packForFile(const ViewTable& views, PackSettings settings, const std::string& output,
                          const AtlasSaveOptions& save, Job& job) {
    STX_TRY(auto atlas, pack(views, settings, job));
    if (largestImageSide(atlas, output, save) <= settings.maxSize) return atlas;
    // Some image holds two pictures of a page: beside each other, or one below the other.
    const int limit = settings.maxSize;
    if (settings.size.x > 0)
        return fail(ErrorCode::usage,
                    "an image here holds two pictures, so that pages of {}x{} make one of more "
                    "than {} pixels; take a smaller --size, or a larger --max-size",
                    settings.size.x, settings.size.y, limit);
    atlas = Atlas();
    // The shorter side of a page is doubled (AtlasTexture::addSecond()): that alone has half.
    std::optional<Result<Atlas>> best;
    for (const glm::ivec2 page : {glm::ivec2(limit, limit / 2), glm::ivec2(limit / 2, limit)}) {
        settings.maxPage = page;
        Job quiet;  // the same notes again
        quiet.workFor(job);
        auto found = pack(views, settings, quiet);
        if (!found && found.error().code != ErrorCode::invalidInput) return found;
        if (!best || (found && (!*best || found->pages.size() < (*best)->pages.size())))
            best = std::move(found);
        if (*best && (*best)->pages.size() == 1) break;  // fewer there cannot be
    }
    if (!*best)
        best->error().message += fmt::format(
            "; an image here holds two pictures, so that one side of each gets half of the {} "
            "pixels",
            limit);
    return *std::move(best);
}

bool prunes(const PackOptions& o) {
    return o.prune || o.pruning.budget > 0 || o.minPsnr;
}

Result<PruneReport> pruneOne(Bundle& bundle, const PackOptions& o, const std::string& input,
                             Job& job) {
    return within(fmt::format("'{}'", input),
                  o.minPsnr ? pruneToQuality(bundle, o.pruning, *o.minPsnr, job)
                            : prune(bundle, o.pruning, job));
}

/// "12 views in 4 textures 2048x1024, 81.2 % used".
std::string summaryOf(const Atlas& atlas) {
    return fmt::format("{} in {} {}x{}, {:.1f} % used", counted(atlas.views.size(), "view"),
                       counted(atlas.textureCount() + atlas.materialTextureCount(), "texture"),
                       atlas.width(), atlas.height(), atlas.used() * 100);
}

/// What a report says of an atlas.
void addReportOf(const Atlas& atlas, double seconds, nlohmann::ordered_json& report) {
    report.update({{"views", atlas.views.size()},
                   {"textures", atlas.textureCount()},
                   {"materialTextures", atlas.materialTextureCount()},
                   {"width", atlas.width()},
                   {"height", atlas.height()},
                   {"used", atlas.used()},
                   {"pixels", {{"source", atlas.sourcePixels}, {"kept", atlas.keptPixels}}},
                   {"seconds", seconds}});
}

/// What pruning left.
struct PrunedTo {
    PruneReport report;
    bool measured = false;  ///< its PSNR is that of pictures

    /// ", 48.1 % of the object's pixels kept, 39.2 dB measured".
    [[nodiscard]] std::string text() const {
        std::string out = fmt::format(", {:.1f} % of the object's pixels kept",
                                      100.0 * static_cast<double>(report.keptPixels) /
                                          static_cast<double>(report.sourcePixels));
        if (measured && std::isfinite(report.psnr))
            out += fmt::format(", {:.1f} dB measured", report.psnr);
        return out;
    }
};

/// An atlas that was written, for its line and the report.
struct Packed {
    std::string output, text;
    double seconds = 0;
    nlohmann::ordered_json report;
};

/// Views into one atlas.
Result<Packed> packViews(const PackOptions& o, std::unique_ptr<ViewTable> views,
                         PackSettings settings, const std::optional<PrunedTo>& pruned,
                         const Stopwatch& watch, Job& job) {
    if (pruned) {
        settings.sourcePixels = pruned->report.sourcePixels;
        settings.unmeasuredPixels = pruned->report.unmeasuredPixels;
    }
    STX_TRY(auto atlas, within(fmt::format("'{}'", o.input),
                               packForFile(*views, settings, o.output, o.save, job)));
    views.reset();
    STX_CHECK(job.checkCancelled());
    Packed packed{o.output, summaryOf(atlas) + (pruned ? pruned->text() : ""), 0, {}};
    packed.report = {
        {"$schema", "pack-report.schema.json"}, {"input", o.input}, {"output", o.output}};
    addReportOf(atlas, 0, packed.report);
    STX_CHECK(writeAtlas(std::move(atlas), o.output, job, o.save));
    packed.report["seconds"] = packed.seconds = watch.seconds();
    return packed;
}

/// The notes, a line for each atlas, and of one alone the report.
Result<void> tell(const PackOptions& o, const std::vector<Packed>& atlases, Program& program) {
    program.sayNotes();
    const std::string input = fmt::format(
        "{} ({})", std::filesystem::path(o.input).filename().string(), humanBytes(o.inputBytes));
    for (const Packed& p : atlases)
        program.say(fmt::format("{} → {} ({}), {}, {}", input, p.output,
                                humanBytes(bytesOf(p.output)), p.text, humanSeconds(p.seconds)));
    return atlases.size() == 1 ? program.writeReport(atlases.front().report) : Result<void>();
}

/// What pruning as it is asked for keeps of views.
Result<Pruning> pruningOf(const PackOptions& o, const ViewTable& views, Job& job) {
    return o.minPsnr ? findPruningToQuality(views, o.pruning, *o.minPsnr, job)
                     : findPruning(views, o.pruning, job);
}

/// Prunes views, if that is asked for.
Result<std::optional<PrunedTo>> pruneViews(const PackOptions& o, const std::string& input,
                                           std::unique_ptr<ViewTable>& views, Job& job) {
    if (!prunes(o)) return std::optional<PrunedTo>();
    const auto found = [&]() -> Result<Pruning> {
        // Whole views take as much of an atlas, pruned or not: that is known before the work.
        if (o.settings.layout == PackSettings::Layout::grid && o.inputs.size() == 1)
            STX_CHECK(checkGrid(*views, o.settings, job.limits));
        return pruningOf(o, *views, job);
    };
    STX_TRY(auto pruning, within(fmt::format("'{}'", input), found()));
    const PrunedTo pruned{pruning.report, o.minPsnr.has_value()};
    views = prunedViews(std::move(views), std::move(pruning));
    return pruned;
}

/// One moment into one atlas.
Result<int> packMoment(const PackOptions& o, Sequence& frames, std::size_t moment,
                       Program& program) {
    STX_TRY(auto views, frames.views(moment, program.job));
    const Stopwatch watch;
    STX_TRY(const auto pruned, pruneViews(o, o.input, views, program.job));
    STX_TRY(auto packed, packViews(o, std::move(views), o.settings, pruned, watch, program.job));
    STX_CHECK(tell(o, {std::move(packed)}, program));
    return 0;
}

/// A frame of a film into one atlas, like the others of its period.
Result<Packed> packFrame(const PackOptions& o, Bundle frame, const PackPeriod* period, Job& job) {
    const Stopwatch watch;
    PackSettings settings = o.settings;
    Bundle content;
    std::optional<PrunedTo> pruned;
    if (period) {
        content = period->content();
        settings.contentOf = &content;
        if (prunes(o)) pruned = PrunedTo{period->prune(frame)};
    }
    return packViews(o, viewsOf(frame), settings, pruned, watch, job);
}

/// Frames from `begin` to before `end`, an atlas each, all with the same rectangles. Adds them to
/// `atlases`.
Result<void> packPeriod(const PackOptions& o, Sequence& frames, std::size_t begin, std::size_t end,
                        std::vector<Packed>& atlases, Program& program) {
    const auto targetOf = [&](std::size_t i) { return *frameName(o.output, static_cast<int>(i)); };
    std::optional<PackPeriod> period;
    // Equal cells in the order of the views are the same without a look at the frames.
    if (prunes(o) || o.settings.layout == PackSettings::Layout::tight) {
        period.emplace();
        for (std::size_t i = begin; i < end; ++i) {
            STX_CHECK(program.job.checkCancelled());
            STX_CHECK(checkTarget(targetOf(i), program));
            // Notes are those of the second time.
            Job quiet;
            quiet.workFor(program.job);
            STX_TRY(const auto whole, frames.frame(i, quiet));
            Bundle pruned = whole;
            if (prunes(o)) {
                STX_CHECK(pruneOne(pruned, o, o.input, program.job));
            }
            STX_CHECK(
                within(fmt::format("'{}': frame {}", o.input, i), period->add(whole, pruned)));
        }
    }
    for (std::size_t i = begin; i < end; ++i) {
        STX_CHECK(program.job.checkCancelled());
        PackOptions one = o;
        one.output = targetOf(i);
        STX_CHECK(checkTarget(one.output, program));
        program.job.progress(static_cast<std::int64_t>(i),
                             static_cast<std::int64_t>(frames.timeline().count()),
                             "writing frames");
        STX_TRY(auto frame, frames.frame(i, program.job));
        STX_TRY(auto packed,
                packFrame(one, std::move(frame), period ? &*period : nullptr, program.job));
        atlases.push_back(std::move(packed));
    }
    return {};
}

/// An atlas for each frame. They appear when all are there, or none does.
Result<int> packFilm(const PackOptions& options, Sequence& frames, Program& program) {
    PackOptions o = options;
    OutputFiles files;
    o.save.output.together = &files;
    std::vector<Packed> atlases;
    const std::size_t count = frames.timeline().count();
    const auto length = static_cast<std::size_t>(o.period);
    for (std::size_t i = 0; i < count; i += length)
        STX_CHECK(packPeriod(o, frames, i, std::min(count, i + length), atlases, program));
    STX_CHECK(files.commit());
    STX_CHECK(tell(o, atlases, program));
    noteOlderFiles(o.output, count, program.job);
    return 0;
}

/// The name of the object that an input becomes: its file's without the ending.
std::string stemOf(const std::string& input) {
    const std::filesystem::path path(input);
    return (path.has_filename() ? path : path.parent_path()).stem().string();
}

/// A name for each input. Errors (usage): another number of --names, two of one name.
Result<std::vector<std::string>> objectNames(const PackOptions& o) {
    std::vector<std::string> names = o.names;
    if (names.empty())
        for (const auto& input : o.inputs) names.push_back(stemOf(input));
    if (names.size() != o.inputs.size())
        return fail(ErrorCode::usage, "--names has {}, and there are {}",
                    counted(names.size(), "name"), counted(o.inputs.size(), "input"));
    std::map<std::string, std::string> inputOf;
    for (std::size_t i = 0; i < names.size(); ++i) {
        const auto [other, isNew] = inputOf.emplace(names[i], o.inputs[i]);
        if (!isNew)
            return fail(ErrorCode::usage,
                        "'{}' and '{}' would both be called '{}'; --names gives each input a name "
                        "of its own",
                        other->second, o.inputs[i], names[i]);
    }
    return names;
}

/// One input as an object: pruned, of one moment. Its views are read from `frames`; what pruning
/// finds of colours without a depth is added to `settings`.
Result<PackTable> openObject(const PackOptions& o, const std::string& input,
                             const std::string& name, std::unique_ptr<Sequence>& frames,
                             PackSettings& settings, Job& job) {
    preloadCodecs(input);
    STX_TRY(frames, openSequence(input, openOptions(o), job));
    STX_TRY(frames, refined(std::move(frames), o.refine, kPacking, folderBeside(o.output)));
    const Timeline timeline = frames->timeline();
    std::size_t moment = 0;
    if (timeline.moves()) {
        if (!o.time)
            return fail(ErrorCode::usage,
                        "'{}' has {} frames, and objects that share an atlas stand still; give "
                        "--time T for a moment of it, in seconds, or pack it alone",
                        input, timeline.count());
        STX_TRY(moment, momentOf(o.time, timeline, nullptr, input, job));
    }
    PackTable object;
    object.name = name;
    STX_TRY(object.views, frames->views(moment, job));
    STX_TRY(const auto pruned, pruneViews(o, input, object.views, job));
    if (pruned) {
        object.sourcePixels = pruned->report.sourcePixels;
        settings.unmeasuredPixels =
            settings.unmeasuredPixels.value_or(0) + pruned->report.unmeasuredPixels;
    }
    return object;
}

/// What a report says of the objects of an atlas.
void addObjectsOf(const Atlas& atlas, nlohmann::ordered_json& report) {
    auto& listed = report["objects"] = nlohmann::ordered_json::array();
    const double area = static_cast<double>(atlas.width()) * atlas.height() *
                        static_cast<double>(atlas.pages.size());
    for (const auto& object : atlas.objects)
        listed.push_back(
            {{"name", object.name},
             {"views", object.views},
             {"used",
              static_cast<double>(coveredPixels(atlas.rectangles, object.firstView, object.views)) /
                  area},
             {"pixels", {{"source", object.sourcePixels}, {"kept", object.keptPixels}}}});
}

/// Of --period where a film is packed by --time.
constexpr const char* kOfAtlases = "of an atlas for each frame";
constexpr const char* kOneMoment = "--time takes one moment";

/// Several inputs into one atlas, each an object with a name.
Result<int> packSheet(const PackOptions& o, const Command& command, Program& program) {
    const Stopwatch watch;
    if (frameName(o.output, 0))
        return fail(ErrorCode::usage,
                    "'{}' numbers the frames of a film, and {} share one atlas; give a name "
                    "without a number",
                    o.output, counted(o.inputs.size(), "input"));
    STX_TRY(const auto names, objectNames(o));
    if (o.inputs.size() > 1 && (!o.budget.empty() || o.minPsnr))
        program.job.note(
            fmt::format("{} is met by each object", o.budget.empty() ? "--min-psnr" : "--budget"));
    std::vector<std::unique_ptr<Sequence>> frames(o.inputs.size());
    std::vector<PackTable> objects;
    PackSettings settings = o.settings;
    std::uint64_t bytes = 0, held = 0;
    for (std::size_t i = 0; i < o.inputs.size(); ++i) {
        STX_CHECK(program.job.checkCancelled());
        STX_TRY(auto object,
                openObject(o, o.inputs[i], names[i], frames[i], settings, program.job));
        bytes += bytesOf(o.inputs[i]);
        held += object.views->bytesHeld();
        STX_CHECK(program.job.limits.checkAllocation(held, 1, "the views of all objects"));
        objects.push_back(std::move(object));
    }
    if (std::ranges::none_of(frames, [](const auto& f) { return f->timeline().moves(); }))
        program.job.noteUnused(command.given({"--time", "--period"}), "of films", "nothing moves");
    else
        program.job.noteUnused(command.given({"--period"}), kOfAtlases, kOneMoment);
    STX_TRY(auto joined, joinTables(std::move(objects), program.job));
    settings.objects = &joined.objects;
    STX_TRY(auto atlas, packForFile(*joined.views, settings, o.output, o.save, program.job));
    joined.views.reset();
    STX_CHECK(program.job.checkCancelled());
    const std::string summary = summaryOf(atlas);
    nlohmann::ordered_json report = {
        {"$schema", "pack-report.schema.json"}, {"inputs", o.inputs}, {"output", o.output}};
    addReportOf(atlas, 0, report);
    addObjectsOf(atlas, report);
    STX_CHECK(writeAtlas(std::move(atlas), o.output, program.job, o.save));
    const double seconds = watch.seconds();
    report["seconds"] = seconds;
    program.sayNotes();
    program.say(fmt::format("{} ({}) → {} ({}), {}, {}", counted(names.size(), "object"),
                            humanBytes(bytes), o.output, humanBytes(bytesOf(o.output)), summary,
                            humanSeconds(seconds)));
    STX_CHECK(program.writeReport(report));
    return 0;
}

/// An atlas holds one moment: that of --time, or one atlas for each frame.
Result<int> packInput(const PackOptions& options, const Command& command, Program& program) {
    PackOptions o = options;
    STX_TRY(o.inputs, expandInputs(options.inputs, command, program));
    STX_TRY(const auto target, folderTarget(options.output, {".exr"}, "a folder or .exr"));
    o.output = target.path;
    if (o.quality && o.colour != "jpeg")
        return fail(ErrorCode::usage, "--quality is of JPEG; give --colour jpeg, too");
    STX_CHECK(setSize(o.size, program.job.limits, o.settings));
    STX_CHECK(checkTarget(o.output, program));
    o.save = {o.colour == "jpeg" ? o.quality.value_or(kJpegQuality) : 0, target.folder,
              program.outputOptions()};
    o.settings.bytesToWrite = bytesToWriteAtlas(o.output, o.save);
    if (!o.budget.empty()) STX_SET(o.pruning.budget, parsePixels(o.budget));
    if (o.inputs.size() > 1 || !o.names.empty()) return packSheet(o, command, program);
    o.input = o.inputs.front();
    o.inputBytes = bytesOf(o.input);
    preloadCodecs(o.input);
    STX_TRY(auto frames, openSequence(o.input, openOptions(o), program.job));
    // One atlas for each frame is made in two passes.
    const bool twice = frames->timeline().moves() && !o.time;
    STX_TRY(frames, (twice ? refinedOnce : refined)(std::move(frames), o.refine, kPacking,
                                                    folderBeside(o.output)));
    const Timeline timeline = frames->timeline();
    const std::size_t count = timeline.count();
    const bool numbered = frameName(o.output, 0).has_value();
    if (!timeline.moves())
        program.job.noteUnused(command.given({"--period"}), "of films",
                               fmt::format("'{}' does not move", o.input));
    else if (o.time)
        program.job.noteUnused(command.given({"--period"}), kOfAtlases, kOneMoment);
    if (o.time || !numbered) {
        if (!o.time && timeline.moves())
            return fail(ErrorCode::usage,
                        "'{}' has {} frames, and an atlas holds one; give --time T, in seconds, or "
                        "a numbered name for one atlas each, as in -o 'atlas_%04d'",
                        o.input, count);
        STX_TRY(const auto moment, momentOf(o.time, timeline, nullptr, o.input, program.job));
        if (numbered) o.output = *frameName(o.output, 0);
        return packMoment(o, *frames, moment, program);
    }
    if (!program.common.report.empty() && count > 1)
        return fail(ErrorCode::usage,
                    "--report is of one atlas, and {} are made; give --time T for one", count);
    if (!o.budget.empty() || o.minPsnr)
        program.job.note(fmt::format("{} is met by each frame; what one of {} keeps, all keep",
                                     o.budget.empty() ? "--min-psnr" : "--budget",
                                     counted(o.period, "frame")));
    return packFilm(o, *frames, program);
}

}  // namespace

void addPack(CommandLine& line, Program& program) {
    Command c = line.add(
        "pack",
        "Merge the reference views into at most 4 textures: colour, depth, normal, splat; and, of "
        "views that have them, metallic-roughness and emissive\n\n"
        "  stx pack model.exr -o atlas           a folder: atlas.json and images\n"
        "  stx pack film.mp4 -o 'atlas_%04d'     an atlas for each frame\n"
        "  stx pack cup.mp4 jug.mp4 -o sheet --size 2048x2048   objects that share the textures\n"
        "  stx pack model.exr -o atlas.exr --layout tight");
    auto o = std::make_shared<PackOptions>();
    c.option("BUNDLE", o->inputs,
             "Bundle or film to pack; several, or @list.txt, become objects of one atlas")
        .required();
    c.option("-o,--output", o->output, "Folder, or one .exr file; of a film a numbered name")
        .required()
        .writes("ATLAS");
    c.option("--names", o->names, "A name for each input (default: its file's, without the ending)")
        .commaSeparated()
        .takes("A,B,...");
    c.option("--time", o->time, "Of a film: the moment to pack, in seconds by its own clock")
        .takes("T");
    c.option("--period", o->period,
             "Of a film: so many frames have the same rectangles, and what pruning keeps in one of "
             "them it keeps in all (default 25)")
        .range(1, 1000)
        .takes("N");
    c.choice<PackSettings::Layout>(
        "--layout", o->settings.layout,
        {{"grid", PackSettings::Layout::grid}, {"tight", PackSettings::Layout::tight}},
        "grid: equal cells in view order; tight: trimmed and packed (default grid)");
    c.option(
         "--padding", o->settings.padding,
         "Pixels around each rectangle, filled from what surrounds it in its view; 1, 3, 7 keep "
         "mip levels 1, 2, 3 clean (default 2)")
        .range(0, 64);
    c.option("--max-size", o->settings.maxSize,
             "Largest side of an image that is written (default 16384)")
        .range(16, 65535);
    c.option("--size", o->size,
             "Textures of exactly this size, or power-of-two: sides of 2^N, the smallest in which "
             "all fits (default: as large as is needed)")
        .takes("WxH");
    c.option("--colour", o->colour,
             "png (exact) or jpeg, in a folder; alpha stays exact (default png)")
        .oneOf({"png", "jpeg"});
    c.option("--quality", o->quality, "Of JPEG (default 92)").range(1, 100);
    refineOption(c, o->refine);
    Command pruning = c.under("Pruning");
    pruning.flag("--prune", o->prune,
                 "Leave out pixels that another kept view shows as well or better");
    pruning.option("--budget", o->budget, "Keep at most so many object pixels, as in 4M")
        .takes("PIXELS");
    pruning
        .option("--min-psnr", o->minPsnr,
                "Prune only as far as pictures of what is kept reach this against pictures of all: "
                "RGB, "
                "the worst of up to 12, rendered from poses of the views and half way between them")
        .takes("DB")
        .range(0.0, 200.0);
    c.objectOption(o->open.object);
    c.sharedOptions(program.common, kOutput | kOutside | kPictures);
    c.runs([o, c](Program& p) { return packInput(*o, c, p); });
}

}  // namespace stx::tools
