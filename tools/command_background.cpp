#include <optional>
#include <set>

#include <nlohmann/json.hpp>

#include "formats/any/open.hpp"
#include "formats/any/save.hpp"
#include "formats/any/sequences.hpp"
#include "formats/files/no_case.hpp"
#include "formats/images/frames.hpp"
#include "formats/images/images.hpp"
#include "formats/mpeg4/mpeg4.hpp"
#include "formats/video/video_frames.hpp"
#include "lib/background/behind_photo.hpp"
#include "lib/background/sequence_background.hpp"
#include "lib/background/still.hpp"
#include "lib/base/stopwatch.hpp"
#include "tools/commands.hpp"

namespace stx::tools {
namespace {

struct BackgroundOptions {
    std::vector<std::string> inputs;
    std::string output, confidence, maskOf, maskOutput;
    std::string method = "select";
    StillSettings settings;
    TemporalBackgroundSettings temporal;
    BehindSettings behind;
    std::string video;
    std::optional<int> crf;
    bool strict = false;
};

/// A mask that is asked for.
struct MaskTarget {
    int frame = 0;
    std::string path;
};

Result<void> checkPngTarget(const std::string& option, const std::string& path, Program& program) {
    if (lowerExtension(path) != ".png")
        return fail(ErrorCode::usage, "{} is '{}'; its name must end in .png", option, path);
    return checkFileTarget(path, program);
}

/// The pattern of the masks' names; beside the background when there is none.
std::string maskPattern(const BackgroundOptions& o) {
    if (!o.maskOutput.empty()) return o.maskOutput;
    const std::filesystem::path output(o.output == "-" ? "background" : o.output);
    return (output.parent_path() / (output.stem().string() + "_mask_%04d.png")).string();
}

/// The files of the masks; an error before the work, not after it.
Result<std::vector<MaskTarget>> maskTargets(const BackgroundOptions& o, const VideoFrames& frames,
                                            Program& program) {
    std::vector<MaskTarget> targets;
    if (o.maskOf.empty()) return targets;
    int first = 0, end = frames.count();
    if (o.maskOf != "all") {
        STX_TRY(const auto number, parseNumbers(o.maskOf, 1, "--mask-of"));
        first = static_cast<int>(std::min(std::max(number[0], -1.0), 2e9));
        if (first < 0 || first >= end || first != number[0])
            return fail(ErrorCode::usage,
                        "--mask-of is {}; 'all' or a frame from 0 to {} is expected", o.maskOf,
                        end - 1);
        end = first + 1;
    }
    const std::string pattern = maskPattern(o);
    std::set<std::string> names = {o.output, o.confidence};
    for (int k = first; k < end; ++k) {
        // The number first: a picture's own name may hold one.
        std::string path = frameName(pattern, k).value_or(pattern);
        if (const auto at = path.find("{stem}"); at != std::string::npos)
            path.replace(at, 6, frames.name(k));
        if (!names.insert(path).second)
            return fail(ErrorCode::usage,
                        "two outputs have the name '{}'; give masks names of their own by "
                        "--mask-output 'mask_%04d.png' or '{{stem}}.png'",
                        path);
        STX_CHECK(checkPngTarget("--mask-output", path, program));
        targets.push_back({k, path});
    }
    return targets;
}

Result<void> writeGrey(const Image<std::uint8_t>& image, const std::string& path,
                       Program& program) {
    STX_TRY(const auto png, encodePng(image.width(), image.height(), 1, 8, image.data(), false));
    return writeFile(path, png, program.outputOptions());
}

Result<void> writeColour(const Rgba8Image& image, const std::string& path, Program& program) {
    Frame frame;
    frame.colour = Image<glm::vec4>(image.width(), image.height());
    std::size_t open = 0;
    for (std::size_t i = 0; i < image.count(); ++i) {
        frame.colour.pixels()[i] = glm::vec4(image.pixels()[i]) / 255.0f;
        open += image.pixels()[i].a == 0;
    }
    FrameOptions options;
    if (open == 0) options.background = glm::vec3(0);  // written without alpha
    options.pngLevel = 6;
    options.noClobber = program.common.noClobber;
    STX_CHECK(writeFrame(frame, path, options));
    if (open > 0)
        program.job.note(
            fmt::format("{} stay open: no frame shows anything there", counted(open, "pixel")));
    return {};
}

Result<void> writeMasks(const std::vector<MaskTarget>& targets, const Rgba8Image& background,
                        VideoFrames& frames, Program& program) {
    std::int64_t done = 0;
    for (const MaskTarget& target : targets) {
        STX_CHECK(program.job.checkCancelled());
        STX_TRY(const auto frame, frames.frame(target.frame));
        STX_TRY(const auto mask, foregroundMask(background, *frame));
        STX_CHECK(writeGrey(mask, target.path, program));
        program.job.progress(++done, static_cast<std::int64_t>(targets.size()), "writing masks");
    }
    return {};
}

double meanConfidence(const Image<std::uint8_t>& confidence) {
    std::uint64_t sum = 0;
    for (const auto c : confidence.pixels()) sum += c;
    return static_cast<double>(sum) / 255.0 / static_cast<double>(confidence.count());
}

/// Whether pictures of an MPEG-4 film are video.
bool holdsVideo(const std::string& input, const Job& job) {
    const auto kind = recognise(input);
    if (!kind || *kind != FileKind::mpeg4) return false;
    Job quiet;
    quiet.limits = job.limits;
    const auto document = readMpeg4(input, quiet);
    return document && mpeg4::holdsVideo(*document);
}

/// Whether one bundle becomes another, and not frames a picture.
bool isBundle(const BackgroundOptions& o) {
    if (o.inputs.size() != 1 || lowerExtension(o.output) != ".exr") return false;
    const auto kind = recognise(o.inputs[0]);
    return kind && (*kind == FileKind::mpeg4 || *kind == FileKind::exr ||
                    *kind == FileKind::atlas || *kind == FileKind::photo);
}

/// What one photograph hides, invented, as a view of its bundle.
Result<int> behindOfStill(const BackgroundOptions& o, const Command& command, Sequence& frames,
                          const Stopwatch& watch, Program& program) {
    const std::string where = fmt::format("'{}'", o.inputs[0]);
    STX_CHECK(command.refuse({"--key-views", "--video", "--crf"},
                             fmt::format("is of films, and {} has one frame", where)));
    STX_TRY(Bundle bundle, frames.frame(0, program.job));
    STX_TRY(const auto added, within(where, addBehind(bundle, o.behind, program.job)));
    program.job.note(added.note(o.behind));
    SaveOptions save;
    save.noClobber = program.common.noClobber;
    STX_CHECK(saveBundle(bundle, o.output, save, program.job));
    const double seconds = watch.seconds();
    program.sayNotes();
    program.say(fmt::format("{} → {} ({}), {} of 1 photograph, {}",
                            std::filesystem::path(o.inputs[0]).filename().string(),
                            std::filesystem::path(o.output).filename().string(),
                            humanBytes(bytesOf(o.output)), counted(1, "background"),
                            humanSeconds(seconds)));
    STX_CHECK(program.writeReport(
        {{"$schema", "background-report.schema.json"},
         {"inputs", o.inputs},
         {"output", o.output},
         {"method", "invented"},
         {"frames", 1},
         {"views", nlohmann::ordered_json::array({{{"name", added.name},
                                                   {"seen", added.seen},
                                                   {"hidden", added.hidden},
                                                   {"border", {added.border.x, added.border.y}}}})},
         {"seconds", seconds}}));
    return 0;
}

/// What the cameras of a bundle with time see behind all that moves, as views of the bundle.
Result<int> backgroundOfBundle(const BackgroundOptions& o, const Command& command,
                               Program& program) {
    const Stopwatch watch;
    if (o.inputs.size() != 1)
        return fail(ErrorCode::usage, "{} inputs for '{}'; one bundle with time is expected",
                    o.inputs.size(), o.output);
    STX_CHECK(checkTarget(o.output, program));
    const std::uint64_t inputBytes = bytesOf(o.inputs[0]);  // before the output takes its place
    preloadCodecs(o.inputs[0]);
    OpenOptions open;
    open.set.strict = o.strict;
    STX_TRY(auto frames, openSequence(o.inputs[0], open.into(o.output), program.job));
    if (frames->timeline().moves() && !holdsSequences(o.output))
        return fail(ErrorCode::usage,
                    "'{}' moves, and '{}' holds one frame; .mp4 and name_%04d.exr hold more",
                    o.inputs[0], o.output);
    if (!frames->timeline().moves()) return behindOfStill(o, command, *frames, watch, program);
    STX_CHECK(command.refuse({"--shift"}, "is of one photograph; a film shows what is behind"));
    STX_TRY(auto found,
            within(fmt::format("'{}'", o.inputs[0]),
                   rememberBackgrounds(
                       frames->timeline().times,
                       [&](std::size_t frame, Job& job) { return frames->frame(frame, job); },
                       o.temporal, program.job)));
    if (found.empty())
        return failAt(fmt::format("'{}'", o.inputs[0]), ErrorCode::invalidInput,
                      "nothing that stays was seen by two frames or more; a background is made of "
                      "what stays");
    auto views = nlohmann::ordered_json::array();
    for (const BackgroundModel& model : found) {
        const auto seen = model.view.pointCount();
        views.push_back(
            {{"name", model.view.name},
             {"seen", static_cast<double>(seen) / static_cast<double>(model.view.depth.count())}});
    }
    const Timeline timeline = frames->timeline();
    frames = withBackgrounds(std::move(frames), std::move(found));
    SaveOptions save;
    save.noClobber = program.common.noClobber;
    if (!o.video.empty()) save.h264 = o.crf.value_or(18);
    STX_CHECK(saveSequence(*frames, o.output, save, program.job));
    if (o.video.empty() && holdsVideo(o.inputs[0], program.job))
        program.job.note(
            fmt::format("the video of '{}' ({}) is written as pictures ({}), without further loss; "
                        "--video h264 writes video",
                        o.inputs[0], humanBytes(inputBytes), humanBytes(bytesOf(o.output))));
    const double seconds = watch.seconds();
    program.sayNotes();
    program.say(fmt::format("{} → {} ({}), {} of {}, {}",
                            std::filesystem::path(o.inputs[0]).filename().string(),
                            std::filesystem::path(o.output).filename().string(),
                            humanBytes(bytesOf(o.output)), counted(views.size(), "background"),
                            counted(timeline.count(), "frame"), humanSeconds(seconds)));
    STX_CHECK(program.writeReport({{"$schema", "background-report.schema.json"},
                                   {"inputs", o.inputs},
                                   {"output", o.output},
                                   {"method", "temporal"},
                                   {"frames", timeline.count()},
                                   {"views", views},
                                   {"seconds", seconds}}));
    return 0;
}

/// The background of plain frames.
Result<int> backgroundOfFrames(const BackgroundOptions& o, Program& program) {
    const Stopwatch watch;
    STX_CHECK(checkFileTarget(o.output, program));
    STX_CHECK(frameFormat(o.output));
    if (!o.confidence.empty()) STX_CHECK(checkPngTarget("--confidence", o.confidence, program));
    const std::vector<std::filesystem::path> inputs(o.inputs.begin(), o.inputs.end());
    preloadCodecs(inputs[0]);
    STX_TRY(auto frames, openVideoFrames(inputs, program.job, o.strict));
    STX_TRY(const auto masks, maskTargets(o, *frames, program));
    STX_TRY(const auto background, stillBackground(*frames, o.settings, program.job));
    // The background last: where it is, the rest is, too.
    STX_CHECK(writeMasks(masks, background.colour, *frames, program));
    if (!o.confidence.empty()) STX_CHECK(writeGrey(background.confidence, o.confidence, program));
    STX_CHECK(writeColour(background.colour, o.output, program));
    const std::string description = frames->description();
    const int count = frames->count();
    frames.reset();  // which says what of them was damaged
    const double seconds = watch.seconds();
    program.sayNotes();
    program.say(fmt::format("{} → {} ({}), {}x{} of {}, {}", description,
                            std::filesystem::path(o.output).filename().string(),
                            humanBytes(bytesOf(o.output)), background.colour.width(),
                            background.colour.height(), counted(background.framesUsed, "frame"),
                            humanSeconds(seconds)));
    auto maskNames = nlohmann::ordered_json::array();
    for (const MaskTarget& mask : masks)
        maskNames.push_back({{"frame", mask.frame}, {"output", mask.path}});
    STX_CHECK(program.writeReport({{"$schema", "background-report.schema.json"},
                                   {"inputs", o.inputs},
                                   {"output", o.output},
                                   {"method", o.method},
                                   {"width", background.colour.width()},
                                   {"height", background.colour.height()},
                                   {"frames", count},
                                   {"framesUsed", background.framesUsed},
                                   {"confidence", meanConfidence(background.confidence)},
                                   {"masks", maskNames},
                                   {"seconds", seconds}}));
    return 0;
}

Result<int> background(const BackgroundOptions& o, const Command& command, Program& program) {
    if (o.settings.method != StillMethod::select)
        STX_CHECK(command.refuse({"--quietest", "--window", "--adaptive", "--drift"},
                                 "is of --method select"));
    if (o.maskOf.empty())
        STX_CHECK(command.refuse({"--mask-output"}, "is of masks; give --mask-of, too"));
    if (holdsSequences(o.output) || isBundle(o)) {
        STX_CHECK(
            command.refuse({"--method", "--frames", "--confidence", "--mask-of", "--mask-output",
                            "--quietest", "--window", "--adaptive", "--drift"},
                           "is of plain video, whose background is a picture"));
        if (o.video.empty())
            STX_CHECK(command.refuse({"--crf"}, "is of video; give --video h264, too"));
        if (const auto container = containerOf(o.output); container && *container == FileKind::exr)
            STX_CHECK(command.refuse({"--video"}, "is of MPEG-4 containers, not of .exr"));
        return backgroundOfBundle(o, command, program);
    }
    STX_CHECK(command.refuse({"--key-views", "--video", "--crf"}, "is of bundles with time"));
    STX_CHECK(command.refuse({"--shift"}, "is of a bundle of one photograph"));
    return backgroundOfFrames(o, program);
}

void addMaskOptions(Command c, const std::shared_ptr<BackgroundOptions>& o) {
    c.option("--mask-of", o->maskOf,
             "Write what of this frame (from 0), or of all, is not background: white in a grey PNG")
        .takes("FRAME|all");
    c.option("--mask-output", o->maskOutput,
             "Names of the masks; %04d is the frame, {stem} the name of its file "
             "(default: the name of -o with _mask_%04d.png)")
        .writes("PATTERN");
}

/// Of the method `select`.
void addSelectOptions(Command c, const std::shared_ptr<BackgroundOptions>& o) {
    c.option("--quietest", o->settings.quietest, "Frames that are kept of each pixel (default 19)")
        .range(1, 255)
        .takes("S");
    c.option("--window", o->settings.windowDivisor,
             "Motion is summed over a square around the pixel: the picture's shorter side over "
             "this (default 6)")
        .range(1, 1000)
        .takes("N");
    c.option("--adaptive", o->settings.adaptive,
             "Keep frames with up to this many times the kept ones' mean motion, too; 0 keeps no "
             "more (default 1.15)")
        .range(0.0, 1000.0)
        .takes("RATIO");
    c.flag("--drift", o->settings.drift,
           "Motion is the change of gradients: light that changes slowly is none");
}

/// Of bundles with time.
void addFilmOptions(Command c, const std::shared_ptr<BackgroundOptions>& o) {
    c.option("--key-views", o->temporal.keyViews,
             "Poses of cameras that move which get a background, at most; as many as see what all "
             "frames see (default 8)")
        .range(1, 64)
        .takes("N");
    c.option("--video", o->video,
             "h264: pictures that change as video, as stx convert does (.mp4, .xmt, .bt; default: "
             "each picture exact)")
        .oneOf({"h264"});
    c.option("--crf", o->crf, "Quality of --video's colour, 0 the best (default 18)").range(0, 51);
}

/// Of bundles of one photograph.
void addBehindOptions(Command c, const std::shared_ptr<BackgroundOptions>& o) {
    c.option("--shift", o->behind.shiftPercent,
             "How far to the side an eye may go without a hole, percent of the median distance "
             "(default 8)")
        .range(0.001, kMostBehindPercent)
        .takes("PERCENT");
}

}  // namespace

void addBackground(CommandLine& line, Program& program) {
    Command c = line.add("background",
                         "What cameras see without those who pass: a picture out of plain video "
                         "of a camera that\nstands still, or views of a bundle with time, whose "
                         "cameras may move\n\n"
                         "  stx background frames/ -o background.png\n"
                         "  stx background frame_%04d.png -o background.png --method n2pg\n"
                         "  stx background hall.y4m -o background.png --mask-of all\n"
                         "  stx background film.mp4 -o film_with_background.mp4\n"
                         "  stx background photo.mp4 -o photo_with_background.mp4 --shift 12");
    auto o = std::make_shared<BackgroundOptions>();
    c.option("FRAMES", o->inputs,
             "Pictures in the order of time, a folder of numbered pictures, their names as "
             "frame_%04d.png, or a .y4m file; or a bundle with time (.mp4, an image set, "
             "name_%04d.exr), or of one photograph")
        .required();
    c.option("-o,--output", o->output,
             "Picture to write (.png, .jpg, .tif, .webp, .exr); of a bundle with time: it with a "
             "background view for each still camera, and for a few poses of those that move (.mp4, "
             ".xmt, .bt, name_%04d.exr); of a bundle of one photograph: it with a view of what it "
             "hides (.exr, too)")
        .required()
        .replaces("IMAGE");
    c.option(
         "--method",
         [o](const std::string& text) -> Result<void> {
             o->method = text;
             o->settings.method = text == "n2pg"     ? StillMethod::n2pg
                                  : text == "median" ? StillMethod::median
                                                     : StillMethod::select;
             return {};
         },
         "select: of each pixel the frames in which least moves around it, and their median (the "
         "best); n2pg: one pass that updates pixels with a stable nearest-neighbour pixel gradient "
         "(the steps of Zhao, Lu and Han 2016; the formulas, which they do not give, are ours); "
         "median: of all frames (default select)")
        .oneOf({"select", "n2pg", "median"});
    c.option("--frames", o->settings.frames, "Frames to look at, spread evenly (default: all)")
        .range(2, 65535)
        .takes("K");
    c.flag("--strict", o->strict, "Frames that are missing or damaged are errors");
    c.option("--confidence", o->confidence,
             "Write how far frames agree with each pixel: 0 (none) to 255 (all)")
        .writes("FILE.png");
    addMaskOptions(c.under("Masks"), o);
    addSelectOptions(c.under("Method select"), o);
    addFilmOptions(c.under("Bundles with time"), o);
    addBehindOptions(c.under("Bundles of one photograph"), o);
    c.sharedOptions(program.common, kOutput | kPictures);
    c.runs([o, c](Program& p) { return background(*o, c, p); });
}

}  // namespace stx::tools
