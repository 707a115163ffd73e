#include <algorithm>
#include <cmath>

#include <nlohmann/json.hpp>

#include "formats/any/given_options.hpp"
#include "formats/any/open.hpp"
#include "formats/any/save.hpp"
#include "formats/any/sequences.hpp"
#include "formats/exr/bundle_exr.hpp"
#include "formats/files/files.hpp"
#include "formats/files/no_case.hpp"
#include "formats/files/numbered.hpp"
#include "formats/images/images.hpp"
#include "formats/imagesets/patterns.hpp"
#include "formats/stx/mesh_views.hpp"
#include "lib/base/stopwatch.hpp"
#include "tools/batch.hpp"
#include "tools/commands.hpp"
#include "tools/environment_options.hpp"
#include "tools/mesh_views.hpp"
#include "tools/photo_options.hpp"
#include "tools/refining.hpp"
#include "tools/view_changes.hpp"
#include "tools/view_tally.hpp"

namespace stx::tools {
namespace {

struct ConvertOptions {
    std::vector<std::string> inputs;
    std::string output;
    std::shared_ptr<MeshViewOptions> mesh = std::make_shared<MeshViewOptions>();
    std::string colour = "png";
    std::string video;
    std::optional<int> crf;
    std::optional<int> quality;
    bool pointTexture = false;
    int octreeLevels = 0;
    int bifsVersion = 0;
    OpenOptions open;
    EnvironmentOptions environment;
    ImportRefining refining;
    bool cube = false;        ///< six faces seen from inside
    std::string frames;       ///< A-B
    bool frameGiven = false;  ///< one frame is asked for
    bool still = false, moving = false;
    /// Options that were given.
    std::vector<std::string> givenOfMeshes, givenOfSets;
    BatchOptions batch;
};

/// Writes the options of image sets that are texts into their numbers.
Result<void> setTextOptions(const std::string& option, const std::string& text,
                            std::vector<double*> to) {
    STX_TRY(const auto numbers, parseNumbers(text, to.size(), option));
    for (std::size_t i = 0; i < to.size(); ++i) *to[i] = numbers[i];
    return {};
}

SaveOptions saveOptions(const ConvertOptions& o, const Program& program) {
    SaveOptions save;
    save.noClobber = program.common.noClobber;
    save.jpegQuality = o.colour == "jpeg" ? o.quality.value_or(kJpegQuality) : 0;
    if (!o.video.empty()) save.h264 = o.crf.value_or(18);
    save.pointTexture = o.pointTexture;
    save.octreeLevels = o.octreeLevels;
    save.bifsVersion = o.bifsVersion;
    return save;
}

/// How an input is opened. `imported` becomes true of an image set that was refined on its way.
OpenOptions openOptions(const ConvertOptions& o, const std::shared_ptr<bool>& imported) {
    OpenOptions open = o.open;
    open.set.refined = [imported](const RefineReport&) { *imported = true; };
    open.set.texturePattern = open.texture;
    open.set.depthBits = o.mesh->depthBits.value_or(open.set.depthBits);
    open.materials = o.mesh->materials;
    return open;
}

/// Heading of the help that options of image sets are under.
constexpr const char* kSetHeading = "Image sets";

constexpr const char* kTimesFromStart = "--times-from-start";

/// Notes the options that do not matter to this input.
void noteUnused(const std::filesystem::path& input, Reads as, const ConvertOptions& o,
                Program& program) {
    GivenOptions given{o.givenOfMeshes, o.givenOfSets, {}, {}};
    if (o.open.timesFromStart) given.ofMpeg4 = {kTimesFromStart};
    if (o.refining.steps != "auto" && o.refining.steps != "off") given.ofViews = {"--refine"};
    if (o.cube) given.ofViews.push_back("--cube");
    noteUnusedOptions(input, as, given, o.open, program.job);
}

/// What was converted, for the summary and the report.
struct Converted {
    std::size_t views = 0;
    PictureSizes sizes;  ///< of a film: of all frames
    std::int64_t points = 0;
    Timeline timeline;
};

Converted summaryOf(const Bundle& bundle, bool countPoints) {
    Converted done;
    done.views = bundle.views.size();
    for (const ReferenceView& view : bundle.views) done.sizes.add(view.camera);
    if (countPoints) done.points = bundle.pointCount();
    return done;
}

/// What is there of a bundle, with the changes that were asked for, if any.
Result<std::unique_ptr<ViewTable>> changedAsAsked(std::unique_ptr<ViewTable> table, bool imported,
                                                  const std::filesystem::path& target,
                                                  const ConvertOptions& o, CodedDepth& codes,
                                                  Program& program) {
    const auto bits = o.mesh->depthBits;
    if (o.refining.steps != "auto")
        STX_SET(table,
                o.refining.refined(std::move(table), imported, folderBeside(target), program.job));
    if (o.cube) STX_SET(table, cubeOf(std::move(table), folderBeside(target), program.job));
    // Readers of image sets have said it for what they made.
    if (!bits || std::ranges::all_of(std::as_const(*table).about().views,
                                     [&](const auto& v) { return v.depthBits == *bits; }))
        return table;
    return changedViews(std::move(table), withDepthBits(*bits, codes));
}

/// One moment, of which each view is written when it is there.
Result<Converted> convertStill(const std::filesystem::path& input,
                               const std::filesystem::path& target, const ConvertOptions& o,
                               bool countPoints, Program& program) {
    const auto imported = std::make_shared<bool>(false);
    STX_TRY(auto opened, openMeshOrViews(input, openOptions(o, imported), program.job));
    auto* mesh = std::get_if<Mesh>(&opened);
    noteUnused(input, mesh ? Reads::mesh : Reads::moment, o, program);
    std::shared_ptr<const Environment> environment;
    if (o.environment.given()) STX_SET(environment, environmentOf(o.environment, program.job));
    Converted done;
    ViewTally tally;
    CodedDepth codes;
    const auto save = [&](std::unique_ptr<ViewTable> table, Job& job) -> Result<void> {
        if (o.environment.given()) table->about().environment = environment;
        if (mesh) table->about().title = input.stem().string();
        const bool onTheWay = countPoints && !table->whole();
        done = summaryOf(table->about(), countPoints && !onTheWay);
        tally.clear();
        if (onTheWay)
            table = watchedViews(std::move(table), [&](auto i, auto& view) { tally.add(i, view); });
        keepFreedMemory();  // of a view, for the next one
        SaveOptions options = saveOptions(o, program);
        // Points and splats are drawn as discs, which look like noise to refine().
        if (mesh)
            options.summaries = mesh->triangles.empty() ? SaveOptions::Summaries::none
                                                        : SaveOptions::Summaries::known;
        return saveViews(*table, target, options, job);
    };
    if (mesh) {
        STX_CHECK(within(fmt::format("'{}'", input.string()),
                         withMeshViews(*mesh, *o.mesh, program, save)));
    } else {
        STX_TRY(auto table, changedAsAsked(std::move(std::get<1>(opened)), *imported, target, o,
                                           codes, program));
        STX_CHECK(save(std::move(table), program.job));
        codes.note(program.job);
    }
    done.points += tally.points();
    return done;
}

/// Frames in time, where the input has them and the target takes them; nothing otherwise.
Result<std::optional<Converted>> convertSequence(const std::filesystem::path& input,
                                                 const std::filesystem::path& target,
                                                 const ConvertOptions& o, bool countPoints,
                                                 Program& program) {
    if (!holdsSequences(target) || o.frameGiven || o.cube ||
        o.open.set.refine.atImport(RefineStep::poses, false))
        return std::nullopt;
    // A mesh, an atlas and one .exr stand still.
    if (o.open.set.from.empty()) {
        const auto kind = recognise(input);
        if (!kind || (*kind != FileKind::imageSet && *kind != FileKind::mpeg4 &&
                      *kind != FileKind::numbered))
            return std::nullopt;
    }
    const auto imported = std::make_shared<bool>(false);
    STX_TRY(auto frames, openSequence(input, openOptions(o, imported).into(target), program.job));
    const bool numbered = frameName(target.string(), 0).has_value();
    if (!frames->timeline().moves() && !numbered) {
        // What stands still goes the way that meshes and atlases take, too: no pixel has been read.
        (void)program.job.takeNotes();
        return std::nullopt;
    }
    if (o.refining.steps != "auto")
        frames =
            changedOnTheWay(std::move(frames), target, [imported, &o](Bundle& bundle, Job& job) {
                return o.refining.refine(bundle, *imported, job);
            });
    CodedDepth codes;
    if (const auto bits = o.mesh->depthBits) {
        ViewChange change = withDepthBits(*bits, codes);
        STX_TRY(const auto container, containerOf(target));
        // MPEG-4 has one range for all frames of a view, and rounds to it itself.
        if (container == FileKind::mpeg4)
            change.change = [set = change.header](ReferenceView& view, Job&) -> Result<void> {
                set(view);
                return {};
            };
        frames = changedByView(std::move(frames), std::move(change));
    }
    if (o.environment.given()) {
        STX_TRY(auto environment, environmentOf(o.environment, program.job));
        frames = inEnvironment(std::move(frames), std::move(environment));
    }
    noteUnused(input, Reads::film, o, program);
    Converted done;
    const Timeline timeline = frames->timeline();
    ViewTally tally;
    frames = tallied(std::move(frames), tally);
    keepFreedMemory();  // of a view, for the next one
    STX_CHECK(saveSequence(*frames, target, saveOptions(o, program), program.job));
    codes.note(program.job);
    done.views = tally.views();
    done.sizes = tally.sizes();
    if (countPoints) done.points = tally.points();
    done.timeline = timeline;
    return done;
}

/// What films take in place of --frame and --frames.
constexpr const char* kInsteadOfFrame =
    "-o 'name_%04d.exr' writes all of its frames, and stx extract --time T one moment as a set";

Result<nlohmann::ordered_json> convertOne(const BatchItem& item, const ConvertOptions& o,
                                          Program& program) {
    const Stopwatch watch;
    const std::filesystem::path input = item.input, target = item.output;
    const std::uint64_t inputBytes = bytesOf(input);  // before the output takes its place
    STX_CHECK(checkTarget(target, program));
    STX_CHECK(containerOf(target));
    if (o.frameGiven)
        STX_CHECK(checkFrameOf(input, o.open, "--frame", kInsteadOfFrame, program.job));
    // Only the report has the points, for which the images must be decoded.
    const bool countPoints = !program.common.report.empty();
    std::optional<Converted> done;
    std::error_code ec;
    // `name_%04d.exr` is not a file's name.
    if (!o.environment.given() && !o.cube && o.open.object.empty() && o.refining.steps == "auto" &&
        (std::filesystem::exists(input, ec) || !frameName(input.string(), 0))) {
        STX_TRY(const auto passed,
                convertDocument(input, target, saveOptions(o, program),
                                o.mesh->depthBits.has_value(), countPoints, program.job));
        if (passed) {
            noteUnused(input, Reads::moment, o, program);
            if (o.open.timesFromStart)
                program.job.noteUnused({kTimesFromStart}, "", "the scene is written as it is");
            done = summaryOf(*passed, countPoints);
            if (done->views == 0)
                program.job.note("the scene shows no view with images; it is written as it is");
        }
    }
    // Only a numbered OpenEXR name takes frames.
    const bool oneFile = !item.numbered && lowerExtension(target) == ".exr";
    if (!done && !oneFile) STX_SET(done, convertSequence(input, target, o, countPoints, program));
    if (!done) {
        const std::string file = oneFile ? item.output : fileOfStill(item.output);
        STX_SET(done, convertStill(input, file, o, countPoints, program));
    }
    const Timeline& timeline = done->timeline;
    if (!o.video.empty() && !timeline.moves())
        program.job.noteUnused({"--video"}, "of films", "nothing moves");
    std::string sizes;
    if (done->views > 0)
        sizes = fmt::format(", {} {}", counted(done->views, "view"), done->sizes.text());
    if (timeline.moves())
        sizes += fmt::format(", {} over {:.4g} s", counted(timeline.count(), "frame"),
                             timeline.duration());
    const double seconds = watch.seconds();
    program.sayNotes();
    program.say(fmt::format("{} ({}) → {} ({}){}, {}", input.filename().string(),
                            humanBytes(inputBytes), target.filename().string(),
                            humanBytes(bytesOf(target)), sizes, humanSeconds(seconds)));
    nlohmann::ordered_json entry{{"input", input.string()},  {"output", target.string()},
                                 {"status", "ok"},           {"exitCode", 0},
                                 {"views", done->views},     {"points", done->points},
                                 {"bytes", bytesOf(target)}, {"seconds", seconds}};
    if (timeline.moves()) {
        entry["frames"] = timeline.count();
        entry["duration"] = timeline.duration();
    }
    return entry;
}

/// One bundle for each frame `A-B` of one set; {frame} in the output's name is the frame.
Result<int> convertFrames(const ConvertOptions& o, Program& program) {
    const auto dash = o.frames.find('-');
    double first = 0, last = 0;
    STX_CHECK(setTextOptions("--frames",
                             dash == std::string::npos
                                 ? o.frames + "," + o.frames
                                 : o.frames.substr(0, dash) + "," + o.frames.substr(dash + 1),
                             {&first, &last}));
    if (!(first >= 0 && first <= last && last < 1e6 && first == std::floor(first) &&
          last == std::floor(last)))
        return fail(ErrorCode::usage, "--frames is '{}'; A-B with 0 <= A <= B is expected",
                    o.frames);
    if (o.inputs.size() != 1 || o.inputs[0][0] == '@')
        return fail(ErrorCode::usage, "--frames takes one image set, not {}", o.inputs.size());
    if (first < last && o.output.find("{frame") == std::string::npos)
        return fail(ErrorCode::usage,
                    "'{}' would be written for each frame; put {{frame}} or {{frame:04}} into its "
                    "name",
                    o.output);
    // Before an hour's work, not after it.
    preloadCodecs(o.inputs[0]);
    OpenOptions open = o.open;
    open.set.texturePattern = open.texture;
    open.set.frame = static_cast<int>(first);
    STX_CHECK(checkFrameOf(o.inputs[0], open, "--frames", kInsteadOfFrame, program.job));
    STX_TRY(const int count, imageSetFrameCount(o.inputs[0], open.set, program.job));
    if (last >= count)
        return failAt(fmt::format("'{}'", o.inputs[0]), ErrorCode::invalidInput,
                      "frames {} are asked for, but the set has {} (0 to {})", o.frames, count,
                      count - 1);
    (void)program.job.takeNotes();  // said again with each frame
    BatchOptions batch = o.batch;
    batch.total = static_cast<std::size_t>(last - first) + 1;
    const auto part = batch.shard.rangeOf(batch.total);
    std::vector<BatchItem> items;
    const auto frameOf = [&](std::size_t index) {
        return static_cast<int>(first) + static_cast<int>(index);
    };
    for (std::size_t i = part.first; i < part.end; ++i)
        items.push_back({o.inputs[0], imagesets::filled(o.output, {"", 0, 0, frameOf(i)}), i,
                         frameName(o.output, 0).has_value()});
    const BatchWork work = [&](const BatchItem& item, Program& p) {
        ConvertOptions one = o;
        one.open.set.frame = frameOf(item.index);
        return convertOne(item, one, p);
    };
    return runInTurn(items, batch, work, program);
}

Result<int> convert(const ConvertOptions& options, const Command& command, Program& program) {
    ConvertOptions o = options;
    STX_TRY(const auto inputs, expandInputs(o.inputs, command, program));
    o.batch.shard.addInputs(inputs);
    o.givenOfMeshes = command.givenUnder(MeshViewOptions::kHeading);
    o.givenOfSets = command.givenUnder(kSetHeading);
    if (o.still && o.moving)
        return fail(ErrorCode::usage, "--still and --moving exclude each other; give one");
    if (o.still || o.moving) o.open.set.moving = o.moving;
    STX_TRY(o.open.set.refine, o.refining.settings());
    if (!command.given({"--fov"}).empty()) o.open.set.photo.fovRad = glm::radians(o.mesh->fovDeg);
    o.frameGiven = !command.given({"--frame", "--frames"}).empty();
    if (o.quality && o.colour != "jpeg")
        return fail(ErrorCode::usage, "--quality is of JPEG; give --colour jpeg, too");
    if (o.video.empty()) STX_CHECK(command.refuse({"--crf"}, "is of --video"));
    if (!o.video.empty())
        STX_CHECK(
            command.refuse({"--point-texture", "--octree-image"}, "does not go with --video"));
    const auto container = containerOf(o.output);
    if (container && *container == FileKind::exr) {
        o.open = o.open.into(o.output);
        if (o.colour == "jpeg")
            STX_CHECK(command.refuse(
                {"--colour"}, "jpeg is of MPEG-4 containers; .exr keeps colours as they are"));
        STX_CHECK(command.refuse({"--video"}, "is of MPEG-4 containers, not of .exr"));
        STX_CHECK(command.refuse({"--point-texture"}, "is of MPEG-4 containers, not of .exr"));
        STX_CHECK(command.refuse({"--bifs-version"}, "is of MPEG-4 containers, not of .exr"));
    }
    STX_CHECK(checkEnvironmentOptions(o.environment, command));
    if (!o.frames.empty()) {
        program.job.noteUnused(command.given({"--jobs"}), "of many inputs",
                               "frames of one set are converted one after the other");
        program.sayNotes();
        return convertFrames(o, program);
    }
    STX_TRY(const auto items, planBatch(inputs, o.output, command));
    STX_CHECK(checkMeshViewOptions(*o.mesh, command, program));
    if (items.size() > 1) STX_CHECK(command.refuse({"--plot"}, "is of one input"));
    STX_CHECK(containerOf(items[0].output));
    const BatchWork work = [&](const BatchItem& item, Program& p) {
        preloadCodecs(item.input);
        return convertOne(item, o, p);
    };
    // One name on the command line is one conversion; a list is a batch, however short.
    o.batch.total = items.size();
    const bool many = items.size() > 1 || o.inputs[0][0] == '@' || o.batch.shard.given;
    o.open.set.manyKinds = many;
    if (many) return runBatch(itemsOf(items, o.batch.shard), o.batch, work, program);
    return runInTurn(items, o.batch, work, program);
}

/// How pictures and scenes are coded.
void addCodingOptions(Command c, const std::shared_ptr<ConvertOptions>& o) {
    c.option("--colour", o->colour, "png (exact) or jpeg, in MPEG-4 containers (default png)")
        .oneOf({"png", "jpeg"});
    c.option("--quality", o->quality, "Of JPEG (default 92)").range(1, 100);
    c.option("--video", o->video,
             "h264: pictures of a film that change as video (MPEG-4; needs the module of video): "
             "colour lossy, depth lossless in 8 or 10 bits (default: each picture exact)")
        .oneOf({"h264"});
    c.option("--crf", o->crf, "Quality of --video's colour, 0 the best (default 18)").range(0, 51);
    c.flag("--point-texture", o->pointTexture, "Write PointTexture nodes (MPEG-4)");
    c.option("--octree-image", o->octreeLevels,
             "Write an OctreeImage (MPEG-4): 2^LEVELS voxels on a side, a picture for each view")
        .range(1, 16)
        .takes("LEVELS");
    c.flag("--cube", o->cube,
           "Of a sensor that turned in place: the views become the six faces of a cube around it, "
           "seen from inside");
    c.option("--bifs-version", o->bifsVersion,
             "Of an MPEG-4 scene's stream: 1 or 2 (default 1, or as the input has it)")
        .range(1, 2);
}

void addBatchOptions(Command c, const std::shared_ptr<ConvertOptions>& o) {
    addJobsOption(c, o->batch);
    c.flag("--keep-going,-k", o->batch.keepGoing, "Go on with the others when an input fails");
    c.flag("--skip-existing", o->batch.skipExisting, "Pass over inputs whose output exists");
    addShardOption(c, o->batch.shard, "inputs, or of --frames");
}

/// What of an image set is read.
void addSetOptions(Command& c, const std::shared_ptr<ConvertOptions>& o) {
    std::vector<std::string> kinds;
    for (const ImageSetKind& kind : imageSetKinds()) kinds.emplace_back(kind.name);
    c.option("--from", o->open.set.from, "Kind of image set, when the files do not show it")
        .oneOf(kinds);
    c.option("--frame", o->open.set.frame,
             "Only this frame of a set that has time, from 0 (default: all, where OUT takes them)")
        .notNegative();
    c.option("--frames", o->frames, "One bundle for each of them; OUT has {frame} in it")
        .takes("A-B");
    c.flag("--still", o->still, "All pictures are of one moment, whatever times they have");
    c.flag(
        "--moving", o->moving,
        "Pictures with times are of a scene that moves: of recordings (TUM), which are taken for "
        "one moment seen from many sides");
    c.option("--every", o->open.set.every,
             "Take each N-th view of a recording, or each N-th frame (default 1)")
        .range(1, 1000000)
        .takes("N");
    c.flag(
        "--strict", o->open.set.strict,
        "Stop at a view whose files are missing (transforms, TUM, 7-Scenes), whose pose is of lost "
        "tracking (TUM, 7-Scenes, Open3D) or that has no usable depth, instead of leaving it out, "
        "and at frames of films that are missing or damaged, instead of showing the ones before");
}

/// Where the files of a set are, and how to read them.
void addSetFiles(Command& c, const std::shared_ptr<ConvertOptions>& o) {
    auto& set = o->open.set;
    c.option(
         "--depth", set.depthPattern,
         "Names of the depth images, {name} {w} {h} {format} {frame} in them; --texture "
         "likewise. Both may be films (.mp4, .mov, .mkv, .webm, .avi), of the cameras in IN. Of "
         "a photo: the picture of its depth, {stem} in it the photo's name")
        .reads("PATTERN");
    c.option("--mask", set.maskPattern,
             "Names of pictures that are white where the object is, {stem} of the colour picture's "
             "file, {name} or (MIV, MSR) {frame} in them, beside the set or in the current folder; "
             "'stx background --mask-of all' makes such masks")
        .reads("PATTERN");
    c.choice<std::optional<NoDepth>>(
        "--no-depth", set.noDepth,
        {{"auto", std::nullopt}, {"unknown", NoDepth::unknown}, {"empty", NoDepth::empty}},
        "What pixels without depth are: empty (nothing is there: seen past) or unknown (a "
        "surface that the sensor missed). auto: as the depth says (infinity or 1e9 and more is "
        "empty), else empty where a picture has transparent pixels or a mask and all that is "
        "opaque has depth, and unknown where not");
    c.option(
         "--yuv",
         [o](const std::string& text) -> Result<void> {
             o->open.set.yuv = {text.starts_with("bt601") ? YuvMatrix::bt601 : YuvMatrix::bt709,
                                text.ends_with("full")};
             return {};
         },
         "Colour of YUV files (default bt709)")
        .oneOf({"bt709", "bt601", "bt709-full", "bt601-full"});
}

/// Cameras and units of sets that do not say them.
void addSetCameras(Command& c, const std::shared_ptr<ConvertOptions>& o) {
    const auto numbers = [&](const char* name, const char* type, const char* help,
                             const std::vector<double*>& to) {
        c.option(
             name, [name, to](const std::string& text) { return setTextOptions(name, text, to); },
             help)
            .takes(type);
    };
    auto& set = o->open.set;
    numbers("--depth-range", "MIN,MAX",
            "What the depth of MSR 3D Video sets spans, and of films: normalised disparity; of a "
            "photo: the distances of its nearest and farthest depth",
            {&set.depthMin, &set.depthMax});
    c.option("--depth-unit", set.depthUnit,
             "Scene units of one step of integer depth, as in 0.001 for millimetres: of films, of "
             "depth beside a photo, and of sets whose depth is distances (default: as the set "
             "says, or as is usual of its kind)")
        .positive();
    c.option(
         "--intrinsics",
         [o](const std::string& text) -> Result<void> {
             auto& k = o->open.set.intrinsics;
             STX_CHECK(setTextOptions("--intrinsics", text, {&k[0], &k[1], &k[2], &k[3]}));
             if (k[0] != 0 && k[1] != 0) return {};
             return fail(ErrorCode::usage, "the focal lengths are {:g} and {:g}", k[0], k[1]);
         },
         "Of TUM, 7-Scenes and Open3D recordings that do not hold them: the colour camera's; of a "
         "photo: in pixels of the upright picture")
        .takes("FX,FY,CX,CY");
    c.option(
         "--depth-intrinsics",
         [o](const std::string& text) -> Result<void> {
             glm::dvec4 k(0);
             STX_CHECK(setTextOptions("--depth-intrinsics", text, {&k.x, &k.y, &k.z, &k.w}));
             o->open.set.depthIntrinsics = k;
             return {};
         },
         "Of the depth of TUM and 7-Scenes recordings, where a camera of its own took it (default: "
         "7-Scenes' known ones)")
        .takes("FX,FY,CX,CY");
    c.option("--depth-to-colour", set.depthToColour,
             "Where that camera is: a text file with rows of R t, a point p of the depth camera "
             "being R p + t in the colour camera (x right, y down, z forward), or none: depth lies "
             "on the pixels of its picture (default: 7-Scenes' known one)")
        .reads("FILE|none");
    c.option("--focal", set.focal, "Focal length of older Middlebury sets, pixels").positive();
    c.option("--baseline", set.baseline,
             "From the first to the last view of those sets that has disparities, scene units")
        .positive();
    c.option("--disparity-offset", set.disparityOffset,
             "Added to their disparities, pixels (default: the number in dmin.txt, which sets of "
             "2006 have, or 0)");
    c.option("--disparity-scale", set.disparityScale,
             "Stored value of one pixel of disparity (default 1)")
        .positive();
}

}  // namespace

void addConvert(CommandLine& line, Program& program) {
    Command c = line.add(
        "convert",
        "Mesh, image set, photograph with depth or bundle to bundle; the output's ending picks the "
        "container\n"
        "(.mp4, .xmt, .bt: MPEG-4; .exr: OpenEXR)\n\n"
        "  stx convert model.glb -o model.mp4 --views sphere:16 --size 512x512\n"
        "  stx convert model.mp4 -o model.xmt\n"
        "  stx convert capture/transforms.json -o capture.exr\n"
        "  stx convert IMG_1234.HEIC -o photo.mp4\n"
        "  stx convert camera.json --texture colour.mp4 --depth depth.mkv -o film.mp4\n"
        "  stx convert @list.txt -o 'out/{stem}.mp4' --jobs 4 --keep-going --skip-existing");
    auto o = std::make_shared<ConvertOptions>();
    c.option("IN", o->inputs,
             "Files or folders to convert; @FILE: those named in its lines, # begins a comment")
        .required();
    c.option("-o,--output", o->output,
             "What to write; {stem} is an input's name, {dir} its folder, {parent} "
             "that folder's name")
        .required()
        .replaces("OUT");
    addMeshViewOptions(c, o->mesh);
    c.flag(kTimesFromStart, o->open.timesFromStart,
           "MPEG-4: startTime and stopTime that come with a later access unit count from the "
           "start, and not from that unit");
    c.under(MeshViewOptions::kHeading)
        .option("--texture", o->open.texture,
                "Texture of a mesh, in place of its own; all are taken for sRGB")
        .reads("IMAGE");
    addCodingOptions(c.under("Coding"), o);
    addEnvironmentOptions(
        c, o->environment,
        "Added to the bundle, in place of one that it has: an equirectangular picture, an OpenEXR "
        "file with envmap, a folder of six faces, or a scene with a Background; none: takes it "
        "away");
    addBatchOptions(c.under("Many inputs"), o);
    Command sets = c.under(kSetHeading);
    addSetOptions(sets, o);
    addSetCameras(sets, o);
    addSetFiles(sets, o);
    addPhotoOptions(sets, o->open.set.photo);
    addBehindOption(sets, o->open.set.photo);
    addImportRefining(c, o->refining, kSetHeading);
    c.objectOption(o->open.object);
    c.sharedOptions(program.common, kOutput | kOutside | kPictures);
    c.runs([o, c](Program& p) { return convert(*o, c, p); });
}

}  // namespace stx::tools
