#include <algorithm>
#include <cmath>

#include <nlohmann/json.hpp>

#include "formats/files/named_files.hpp"
#include "formats/images/frames.hpp"
#include "formats/images/images.hpp"
#include "formats/stx/stx.hpp"
#include "lib/base/stopwatch.hpp"
#include "lib/render/around/around.hpp"
#include "lib/render/factory.hpp"
#include "tools/commands.hpp"
#include "tools/frame_writer.hpp"
#include "tools/light_options.hpp"
#include "tools/refining.hpp"
#include "tools/render_scene.hpp"
#include "tools/stage_options.hpp"
#include "tools/view_tally.hpp"

namespace stx::tools {
namespace {

/// "25", "29.97" or "30000/1001", as a fraction.
Result<std::pair<int, int>> parseRate(const std::string& text) {
    const auto wrong = [&] {
        return fail(ErrorCode::usage,
                    "--fps is '{}'; 0.001 to 1000, or a fraction as in 30000/1001, is expected",
                    text);
    };
    const auto slash = text.find('/');
    const auto top = parseNumbers(text.substr(0, slash), 1, "--fps");
    if (!top) return wrong();
    double numerator = (*top)[0], denominator = 1;
    if (slash != std::string::npos) {
        const auto bottom = parseNumbers(text.substr(slash + 1), 1, "--fps");
        if (!bottom) return wrong();
        denominator = (*bottom)[0];
        const auto whole = [](double v) { return v >= 1 && v <= 1e9 && v == std::floor(v); };
        if (!whole(numerator) || !whole(denominator)) return wrong();
    } else if (numerator != std::floor(numerator)) {
        numerator = std::round(numerator * 1000);
        denominator = 1000;
    }
    if (!(numerator / denominator >= 0.001 && numerator / denominator <= 1000)) return wrong();
    return std::pair(static_cast<int>(numerator), static_cast<int>(denominator));
}

/// What --background says is put where no view shows a surface; nothing for a colour.
std::optional<Fill> fillOf(const std::string& background) {
    if (background == "temporal") return Fill::background;
    if (background == "spatial") return Fill::spatial;
    if (background == "none") return Fill::none;
    return {};
}

/// A colour; nothing for the words that are none.
Result<std::optional<glm::vec3>> parseBackground(const std::string& text) {
    if (text.empty() || fillOf(text)) return std::optional<glm::vec3>();
    STX_TRY(const auto colour, parseColour(text, "--background"));
    return std::optional<glm::vec3>(colour);
}

/// Whether pictures are of this format, in files or on stdout.
bool isOf(FrameFormat format, const RenderOptions& o) {
    if (o.output == "-") return o.fileFormat == (format == FrameFormat::exr ? "exr" : "png");
    const auto written = frameFormat(o.output);
    return written && *written == format;
}

/// Errors (usage) for options that cannot matter, whatever the input is.
Result<void> checkOptions(const RenderOptions& o, const Command& command) {
    if (o.lights.empty())
        STX_CHECK(command.refuse({"--ambient", "--specular", "--shininess"},
                                 "is of lighting; give --light, too"));
    if (o.time.time)
        STX_CHECK(command.refuse({"--times"}, "and --time exclude each other; give one"));
    if (o.output == "-") {
        STX_CHECK(command.refuse({"--shard"}, "is of numbered files; a stream is one piece"));
        STX_CHECK(command.refuse({"--skip-existing"}, "is of files; -o is '-', standard output"));
    }
    if (o.output != "-" || o.fileFormat != "y4m")
        STX_CHECK(command.refuse({"--fps"}, "is of a stream on stdout, -o - --file-format y4m"));
    if (!isOf(FrameFormat::png, o))
        STX_CHECK(command.refuse({"--compression"}, "is of .png pictures"));
    if (o.backend == Backend::cpu)
        STX_CHECK(command.refuse({"--device"}, "is of GPUs; it does not go with --backend cpu"));
    if (o.settings.pipeline != GpuPipeline::automatic)
        for (const auto& [backend, name] : {std::pair(Backend::cpu, "cpu"), {Backend::gl, "gl"}})
            if (o.backend == backend)
                STX_CHECK(command.refuse(
                    {"--pipeline"},
                    fmt::format("is of the gpu backend; it does not go with --backend {}", name)));
    if (fillOf(o.background))
        STX_CHECK(command.refuse({"--fill"}, "says what --background " + o.background +
                                                 " says already; give one of them"));
    STX_CHECK(checkEnvironmentOptions(o.environment, command));
    if (o.background == "spatial" && o.environment.given() && !o.environment.none())
        return fail(
            ErrorCode::usage,
            "--background spatial fills what no view shows from what is around it; that and "
            "--environment exclude each other");
    if (o.settings.splat != SplatRule::paper)
        STX_CHECK(command.refuse({"--splat-coefficient"}, "is of --splat paper"));
    return {};
}

Result<RenderSettings> settingsOf(const RenderOptions& o) {
    RenderSettings s = o.settings;
    s.fill = fillOf(o.background).value_or(s.fill);
    // Who asks for another background does not want the scene's own.
    s.ownEnvironment =
        !o.environment.given() && (o.background.empty() || o.background == "temporal");
    // What only OpenEXR can hold.
    s.lighting.beyondOne = isOf(FrameFormat::exr, o);
    if (s.lighting.beyondOne) s.normals = true;
    for (const auto& text : o.lights) {
        if (text == kEnvironmentLight) continue;
        STX_TRY(const auto light, parseLight(text, glm::dvec3(0.0)));
        s.lighting.lights.push_back(light);
    }
    STX_TRY(s.refine, refineSettings(o.refine));
    if (s.refine.on(RefineStep::poses))
        return fail(ErrorCode::usage,
                    "the step 'poses' moves cameras, and pictures are drawn where they are; move "
                    "them first: stx refine --with poses");
    if (!o.without.empty()) STX_CHECK(leaveOut(o.without, s));
    if (!o.matchColours) s.refine.set(RefineStep::exposure, false);
    if (o.explain) s.log = std::make_shared<StageLog>();
    STX_TRY(s.lighting.ambient, parseGreyOrRgb(o.ambient, "--ambient"));
    STX_TRY(s.lighting.specular, parseGreyOrRgb(o.specular, "--specular"));
    s.lighting.shininess = static_cast<float>(o.shininess);
    for (const auto& [option, value] : {std::pair{"--ambient", s.lighting.ambient},
                                        std::pair{"--specular", s.lighting.specular}}) {
        if (glm::any(glm::lessThan(value, glm::vec3(0.0f))))
            return fail(ErrorCode::usage, "{} is negative; light is 0 or more", option);
    }
    return s;
}

Result<int> printDevices(Program& program) {
    const auto devices = listDevices(program.job);
    for (const auto& d : devices)
        program.print(fmt::format("{}: {} ({}, OpenGL {}, textures up to {}{})\n", d.index, d.name,
                                  d.platform, d.version, d.maxTextureSize,
                                  d.software ? ", software" : ""));
    if (!devices.empty()) return 0;
    return fail(ErrorCode::unsupported,
                "no OpenGL device was found through EGL; install libegl-mesa0 and libgl1-mesa-dri "
                "for a software one");
}

/// Errors when one of the pictures is an input or a file that one names, under --no-clobber when
/// it exists.
Result<void> checkFrames(const RenderOptions& o, int count, Program& program) {
    if (o.skipExisting) return {};
    const auto part = o.shard.rangeOf(static_cast<std::size_t>(count));
    for (std::size_t i = part.first; i < part.end; ++i) {
        if (const auto name = frameName(o.output, static_cast<int>(i)))
            STX_CHECK(program.common.noClobber ? checkTarget(*name, program)
                                               : checkIsNotNamed(*name));
    }
    return {};
}

/// The camera of a reference view, which may move, in a picture as large as `picture`.
Camera ofView(const std::vector<Camera>& views, const RenderOptions& o, const Camera& picture) {
    return inPicture(views[o.camera.view], glm::ivec2(picture.width, picture.height));
}

/// The options of pictures all around: what a lens would say is refused.
Result<void> prepareAround(RenderOptions& o, const Command& command, Program& program) {
    if (!o.around) return {};
    STX_CHECK(command.refuse({"--fov", "--ortho"},
                             "is of a lens; --projection equirectangular sees all around"));
    if (o.camera.size.empty()) o.camera.size = "1024x512";
    STX_TRY(const auto size, parseSize(o.camera.size, program.job.limits));
    if (size.x != 2 * size.y || size.y < 2)
        return fail(ErrorCode::usage,
                    "--size is {}x{}; an equirectangular picture is twice as wide as high, 4x2 at "
                    "least",
                    size.x, size.y);
    return {};
}

/// Errors (usage) for several pictures without a numbered name, and (io) as checkFrames().
Result<void> checkNames(const RenderOptions& o, int count, Program& program) {
    const bool film = o.output == "-" && (o.fileFormat.empty() || o.fileFormat == "y4m");
    if (count > 1 && !frameName(o.output, 0) && !film)
        return fail(ErrorCode::usage,
                    "{} pictures need a numbered name, as in -o 'name_%04d.png' (a film: -o - "
                    "--file-format y4m)",
                    count);
    return checkFrames(o, count, program);
}

/// How pictures are written; the rate of a stream is --fps, else 25.
Result<FrameWriter::Settings> writingOf(const RenderOptions& o, Program& program) {
    FrameWriter::Settings writing;
    writing.pattern = o.output;
    STX_TRY(writing.background, parseBackground(o.background));
    writing.stream = o.fileFormat;
    STX_TRY(writing.rate, parseRate(o.framesPerSecond.empty() ? "25" : o.framesPerSecond));
    writing.compression = o.compression;
    writing.around = o.around;
    writing.noClobber = program.common.noClobber;
    STX_CHECK(FrameWriter::check(writing));
    return writing;
}

/// The rate of a stream of what moves by itself or by its cameras; nothing when --fps says it.
std::optional<std::pair<int, int>> ownRate(const RenderOptions& o, const DrawnScene& scene,
                                           const std::vector<NovelCamera>& pictures, Job& job) {
    if (!scene.moving || !scene.moving->timeline().moves() || o.output != "-" ||
        !o.framesPerSecond.empty())
        return {};
    if (o.time.times == "all")
        return streamRateOf(scene.moving->timeline(), "frames of the film", job);
    if (const auto clock = clockOf(pictures); clock && o.time.times == "cameras")
        return streamRateOf(*clock, "pictures of the cameras", job);
    return {};
}

/// What was drawn.
struct Drawn {
    nlohmann::ordered_json views = nlohmann::ordered_json::array();  ///< as the report has them
    Renderer* renderer = nullptr;  ///< of the last picture; null when all were there
    double milliseconds = 0;       ///< of all pictures
    std::size_t count = 0;         ///< pictures, without those that were there
    std::size_t empty = 0;         ///< of those: without the object
};

/// Draws and writes this shard's pictures.
Result<Drawn> drawPictures(const RenderOptions& o, DrawnScene& scene,
                           const std::vector<NovelCamera>& pictures,
                           const FrameWriter::Settings& writing, Program& program) {
    FrameWriter writer(writing, program.job);
    Drawn drawn;
    drawn.renderer = scene.still.get();
    const auto addToReport = [&](std::size_t i, nlohmann::ordered_json picture) {
        if (!pictures[i].name.empty()) picture["camera"] = pictures[i].name;
        if (o.shard.given) picture["index"] = i;
        drawn.views.push_back(std::move(picture));
    };
    const auto part = o.shard.rangeOf(pictures.size());
    for (std::size_t i = part.first; i < part.end; ++i) {
        const auto name = writer.nameOf(static_cast<int>(i));
        std::error_code ec;
        if (o.skipExisting && o.output != "-" && std::filesystem::exists(name, ec)) {
            addToReport(i, {{"output", name}, {"skipped", true}});
            continue;
        }
        STX_CHECK(program.job.checkCancelled());
        const bool more = !o.skipExisting && i + 1 < part.end;
        Camera camera = pictures[i].camera;
        if (scene.moving) {
            STX_TRY(auto now,
                    within(fmt::format("picture {}", i),
                           scene.moving->at(*pictures[i].time, more ? pictures[i + 1].time
                                                                    : std::optional<double>())));
            drawn.renderer = now;
            if (o.camera.view >= 0 && !(o.camera.swayPercent > 0))
                camera = ofView(scene.moving->views(), o, camera);
        } else if (more && !o.around) {
            drawn.renderer->expect(pictures[i + 1].camera);
        }
        const Stopwatch watch;
        STX_TRY(auto frame, within(fmt::format("picture {}", i),
                                   o.around ? renderAround(*drawn.renderer, camera, camera.width,
                                                           camera.height, program.job)
                                            : drawn.renderer->render(camera)));
        const double milliseconds = watch.milliseconds();
        drawn.milliseconds += milliseconds;
        ++drawn.count;
        nlohmann::ordered_json picture = {{"output", name}, {"milliseconds", milliseconds}};
        if (scene.moving) picture["time"] = *pictures[i].time;
        addToReport(i, std::move(picture));
        const bool nothing =
            scene.environment
                ? std::ranges::none_of(frame.depth.pixels(), [](float d) { return hasPoint(d); })
                : std::ranges::all_of(frame.colour.pixels(),
                                      [](glm::vec4 c) { return !(c.a > 0); });
        if (nothing) ++drawn.empty;
        STX_CHECK(writer.write(static_cast<int>(i), frame, camera));
        drawn.renderer->reuse(std::move(frame));
        program.job.progress(static_cast<std::int64_t>(i - part.first) + 1,
                             static_cast<std::int64_t>(part.end - part.first), "rendering");
    }
    STX_CHECK(writer.finish());
    return drawn;
}

/// What is lost in pictures whose background was to be transparent, as a note.
void noteAlphaLost(const RenderOptions& o, const DrawnScene& scene, Job& job) {
    if (o.background != "none" || scene.environment) return;
    const bool film = o.fileFormat == "y4m";
    const auto format = frameFormat(o.output);
    if (film || (format && *format == FrameFormat::jpeg))
        job.note(
            fmt::format("{} has no alpha: what no view shows is black", film ? "y4m" : "JPEG"));
}

/// The notes and the line of a run that is done.
void sayDrawn(const RenderOptions& o, const DrawnScene& scene, const Drawn& drawn,
              const std::vector<NovelCamera>& pictures, Program& program) {
    if (drawn.empty > 0)
        program.job.note(fmt::format(
            "{} {} nothing{}: the object is behind or beside the camera, or smaller than a "
            "pixel; 'stx info' tells its "
            "bounds",
            counted(drawn.empty, "picture"), drawn.empty == 1 ? "shows" : "show",
            scene.environment ? " but the environment" : ""));
    noteAlphaLost(o, scene, program.job);
    program.sayNotes();
    const auto part = o.shard.rangeOf(pictures.size());
    const std::size_t all = part.end - part.first;
    PictureSizes sizes;
    for (const NovelCamera& picture : pictures) sizes.add(picture.camera);
    program.say(fmt::format(
        "{} → {}, {} {}, {}{}{}", std::filesystem::path(o.input).filename().string(), o.output,
        counted(all, "picture"), sizes.text(), drawn.renderer ? drawn.renderer->backend() : "",
        drawn.count > 0
            ? fmt::format(", {:.1f} ms each", drawn.milliseconds / static_cast<double>(drawn.count))
            : "",
        drawn.count < all ? fmt::format(", {} skipped", all - drawn.count) : ""));
}

Result<int> render(const RenderOptions& given, const Command& command, Program& program) {
    RenderOptions o = given;
    STX_CHECK(prepareAround(o, command, program));
    if (o.listDevices) return printDevices(program);
    if (o.input.empty() || o.output.empty())
        return fail(ErrorCode::usage, "an input and -o OUTPUT are needed. See 'stx render --help'");
    STX_CHECK(checkOptions(o, command));
    // The environment is what ambient light stands for.
    if (lightsByEnvironment(o) && command.given({"--ambient"}).empty()) o.ambient = "0";
    STX_TRY(auto settings, settingsOf(o));
    STX_CHECK(parseBackground(o.background));
    STX_CHECK(checkFileTarget(o.output, program));
    STX_TRY(const int wanted, checkCameraOptions(o.camera, command, program));
    STX_CHECK(checkNames(o, wanted, program));
    STX_TRY(auto writing, writingOf(o, program));

    keepFreedMemory();
    o.open = o.open.into(o.fileFormat == "exr" ? "stream.exr" : o.output);
    preloadCodecs(o.input);
    STX_TRY(const auto around, environmentOf(o.environment, program.job));
    if (around) STX_SET(settings.environment, EnvironmentMap::make(*around, program.job.limits));
    STX_TRY(auto scene, openScene(o, settings, command, program));
    if (lightsByEnvironment(o) && !scene.moving)
        STX_CHECK(lightBy(scene.model, settings, program.job));
    STX_TRY(const auto pictures, picturesOf(o, scene, program));
    STX_CHECK(checkNames(o, static_cast<int>(pictures.size()), program));
    STX_CHECK(checkPictures(o, settings, pictures, scene, program.job.limits));
    // Of a mesh it is noted already, with all that is of views.
    const bool mayUsePipeline = o.settings.pipeline != GpuPipeline::automatic &&
                                settings.mode == RenderMode::splat &&
                                !std::holds_alternative<Mesh>(scene.model);
    writing.origin = scene.context.origin;
    writing.rate = ownRate(o, scene, pictures, program.job).value_or(writing.rate);
    if (!scene.moving) {
        STX_CHECK(makeStill(o, settings, pictures, scene, program.job));
    }
    program.sayNotes();

    STX_TRY(const auto drawn, drawPictures(o, scene, pictures, writing, program));
    if (mayUsePipeline && drawn.renderer && drawn.renderer->backend() == "cpu")
        program.job.noteUnused({"--pipeline"}, "",
                               "it is of the gpu backend, and the cpu backend draws");
    sayDrawn(o, scene, drawn, pictures, program);
    nlohmann::ordered_json report = {
        {"$schema", "render-report.schema.json"},
        {"backend", drawn.renderer ? drawn.renderer->backend() : ""},
        {"device", drawn.renderer ? drawn.renderer->device() : ""},
        {"mode", settings.mode == RenderMode::splat ? "splat" : "surface"},
        {"points", scene.moving ? scene.moving->points() : scene.points},
        {"views", drawn.views}};
    if (o.shard.given) report["shard"] = shardJson(o.shard, pictures.size());
    if (settings.log) {
        report["stages"] = stagesJson(*settings.log);
        const std::string text = explained(*settings.log, drawn.count);
        // Where the pictures go to stdout it is for a person beside them.
        o.output == "-" ? program.say(text) : program.print(text);
    }
    STX_CHECK(program.writeReport(report));
    return 0;
}

void addDrawing(Command c, RenderOptions& o) {
    c.choice<Backend>("--backend", o.backend,
                      {{"auto", Backend::automatic},
                       {"gpu", Backend::gpu},
                       {"gl", Backend::gl},
                       {"cpu", Backend::cpu}},
                      "auto, gpu, gl or cpu (default auto: a real GPU, else cpu)");
    c.option("--device", o.device, "Number of the GPU to use, see --list-devices");
    c.flag("--list-devices", o.listDevices, "Print the GPUs there are and stop");
    c.choice<GpuPipeline>(
        "--pipeline", o.settings.pipeline,
        {{"auto", GpuPipeline::automatic},
         {"compute", GpuPipeline::compute},
         {"raster", GpuPipeline::raster}},
        "Of splats on a GPU: auto, compute (atomics; OpenGL 4.5) or raster (vertex texture "
        "fetch; OpenGL 3.3) (default auto: by what the device has)");
    c.choice<RenderMode>("--mode", o.settings.mode,
                         {{"surface", RenderMode::surface}, {"splat", RenderMode::splat}},
                         "surface: best pictures; splat: the paper's (default surface)");
    c.choice<Quality>(
        "--quality", o.settings.quality,
        {{"normal", Quality::normal}, {"best", Quality::best}, {"draft", Quality::normal}},
        "Of surface mode: normal or best (default normal); draft is an older name of normal");
    c.choice<SplatRule>(
        "--splat", o.settings.splat,
        {{"data", SplatRule::data}, {"paper", SplatRule::paper}, {"point", SplatRule::point}},
        "Size and shape of splats: data, paper or point (default data)");
    c.option("--splat-coefficient", o.settings.splatCoefficient,
             "Of --splat paper: pixels times scene units (default: fitted)")
        .positive();
    c.choice<Fill>("--fill", o.settings.fill,
                   {{"background", Fill::background}, {"none", Fill::none}},
                   "What no view shows: background (--background temporal) or none (default "
                   "background)");
    c.choice<bool>("--match-colours", o.matchColours, {{"auto", true}, {"off", false}},
                   "Gains and offsets between views that differ clearly where they show the same "
                   "surface (exposure, white balance): auto brings them to those of most, off "
                   "leaves them (default auto)");
    refineOption(c, o.refine);
    c.option(
         "--without", o.without,
         "Leave out stages, with commas between them: " + stageNames() + ", and those of --refine")
        .takes("STAGES");
    c.flag("--explain", o.explain,
           "Print what each stage takes and how many pixels it changes (in the report, too)");
    c.option("--background", o.background,
             "What stands where no view shows a surface. temporal: the bundle's background views, "
             "then what is around, in scenes that fill the frame (default); spatial: what is "
             "around only; none: nothing, alpha is kept. Or a colour behind all of it: values of 0 "
             "to 1, #rrggbb or a name such as white")
        .takes("temporal|spatial|none|COLOUR");
    addEnvironmentOptions(
        c, o.environment,
        "Shown where nothing covers a pixel: an equirectangular picture, an OpenEXR file with "
        "envmap, a folder of six faces, or a scene with a Background; none: not even the scene's "
        "own, which is shown otherwise (but with --background spatial, none or a colour)");
}

void addLighting(Command c, RenderOptions& o) {
    c.option("--light", o.lights,
             "dir:X,Y,Z[,r,g,b] shines along X,Y,Z; point:X,Y,Z[,r,g,b] is at X,Y,Z; @camera "
             "appended: in camera space; environment: diffuse and glossy light from all around, of "
             "--environment or the scene's own. Repeat for more")
        .takes("LIGHT");
    c.option("--ambient", o.ambient,
             "Ambient light, grey or r,g,b (default 0.2; 0 with --light environment)");
    c.option("--specular", o.specular, "Specular reflection, grey or r,g,b (default 0)");
    c.option("--shininess", o.shininess, "Phong exponent, above 0 (default 32)").positive();
}

void addOutput(Command c, RenderOptions& o) {
    c.option("--file-format", o.fileFormat,
             "Of what goes to stdout, -o -: y4m (a film), png or exr (one picture)")
        .oneOf({"y4m", "png", "exr"});
    c.option("--format", o.fileFormat, "The same as --file-format").oneOf({"y4m", "png", "exr"});
    c.option("--compression", o.compression,
             "Of .png, 0 to 9: 1 takes least time, 9 makes files a tenth smaller (default 1)")
        .range(0, 9);
    c.option(
         "--fps", o.framesPerSecond,
         "Frame rate written into the stream, as in 30 or 30000/1001 (default: of --times all the "
         "input's, of --times cameras theirs, else 25)")
        .takes("RATE");
    c.flag("--skip-existing", o.skipExisting, "Leave pictures that exist as they are");
    addShardOption(c, o.shard, "pictures");
    c.flag("--times-from-start", o.open.timesFromStart,
           "MPEG-4: startTime and stopTime that come with a later access unit count from the "
           "start, and not from that unit");
    c.option("--texture", o.open.texture,
             "Texture of a mesh, in place of its own; all are taken for sRGB")
        .reads("IMAGE");
}

}  // namespace

void addRender(CommandLine& line, Program& program) {
    Command c = line.add(
        "render",
        "Novel views of a bundle, an atlas or a mesh\n\n"
        "  stx render model.mp4 -o view.png --eye 0,1,4 --target 0,0,0\n"
        "  stx render atlas -o orbit_%04d.png --orbit 60 --elevation 20\n"
        "  stx render model.exr -o - --orbit 250 --file-format y4m | ffmpeg -i - orbit.mp4\n"
        "  stx render photo.mp4 -o wiggle_%03d.png --sway 5");
    auto o = std::make_shared<RenderOptions>();
    c.option("IN", o->input, "Bundle, atlas or mesh");
    c.option("-o,--output", o->output,
             ".png, .jpg, .exr, .tif or .webp; name_%04d.png for several; - for a y4m stream")
        .writes("IMAGE");
    addCameraOptions(c, o->camera);
    c.under("Camera").choice<bool>(
        "--projection", o->around, {{"perspective", false}, {"equirectangular", true}},
        "equirectangular: all that is seen from the camera's place, 360 by 180 degrees, "
        "what it looks at in the middle (1024x512 by default); in .exr Z is the length "
        "of the ray, and 'stx convert --from panorama' reads it back (default: as the "
        "camera is)");
    Command time = c.under("Time");
    time.option("--time", o->time.time,
                "The moment of an input that moves, in seconds by its own clock, which stx info "
                "tells (default: its first)")
        .takes("T");
    time.option(
            "--times", o->time.times,
            "A picture for each frame from A to B seconds, or each STEP seconds between; all: each "
            "frame; cameras: the times of the --cameras file. With several cameras: as many")
        .takes("A:B[:STEP]|all|cameras");
    addDrawing(c.under("Drawing"), *o);
    addLighting(c.under("Lighting (Phong, in linear light; off without --light)"), *o);
    addOutput(c.under("Output"), *o);
    c.objectOption(o->open.object);
    c.sharedOptions(program.common, kOutput | kOutside | kPictures);
    c.runs([o, c](Program& p) { return render(*o, c, p); });
}

}  // namespace stx::tools
