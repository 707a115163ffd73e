#include <algorithm>
#include <chrono>
#include <cmath>

#include <nlohmann/json.hpp>

#include "formats/any/sequences.hpp"
#include "formats/images/frames.hpp"
#include "formats/images/images.hpp"
#include "formats/stx/stx.hpp"
#include "lib/render/around/around.hpp"
#include "lib/render/factory.hpp"
#include "tools/camera_options.hpp"
#include "tools/commands.hpp"
#include "tools/environment_options.hpp"
#include "tools/frame_writer.hpp"
#include "tools/light_options.hpp"
#include "tools/picture_times.hpp"
#include "tools/refining.hpp"
#include "tools/shard.hpp"
#include "tools/stage_options.hpp"

namespace stx::tools {
namespace {

struct RenderOptions {
    std::string input, output;
    CameraOptions camera;
    TimeOptions time;
    Backend backend = Backend::automatic;
    RenderSettings settings;  ///< without the lighting
    std::string background;   ///< empty: not given
    EnvironmentOptions environment;
    bool around = false;  ///< equirectangular pictures
    std::vector<std::string> lights;
    std::string ambient = "0.2", specular = "0";
    std::string refine = "auto", without;
    bool matchColours = true, explain = false;
    double shininess = 32;
    std::string fileFormat;
    std::string framesPerSecond;  ///< empty: that of the input, else 25
    int compression = 1;
    bool skipExisting = false, listDevices = false;
    Shard shard;
    int device = -1;
    OpenOptions open;
};

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

/// The word for --light that is not a Light.
constexpr const char* kEnvironmentLight = "environment";
bool lightsByEnvironment(const RenderOptions& o) {
    return std::ranges::find(o.lights, kEnvironmentLight) != o.lights.end();
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

/// Errors (usage) for options that cannot matter, whatever the input is.
Result<void> checkOptions(const RenderOptions& o, const Command& command) {
    if (o.lights.empty())
        STX_CHECK(command.refuse({"--ambient", "--specular", "--shininess"},
                                 "is of lighting; give --light, too"));
    if (o.time.time)
        STX_CHECK(command.refuse({"--times"}, "and --time exclude each other; give one"));
    if (o.output == "-")
        STX_CHECK(command.refuse({"--shard"}, "is of numbered files; a stream is one piece"));
    if (o.output != "-")
        STX_CHECK(command.refuse({"--fps"}, "is of a stream on stdout, -o - --file-format y4m"));
    if (const auto format = frameFormat(o.output);
        o.output == "-" || !format || *format != FrameFormat::png)
        STX_CHECK(command.refuse({"--compression"}, "is of .png pictures"));
    if (o.backend == Backend::cpu)
        STX_CHECK(command.refuse({"--device"}, "is of GPUs; it does not go with --backend cpu"));
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

/// Notes options that do not matter to this model and mode: scripts pass them to all.
void noteUnused(const Model& model, const RenderOptions& o, const Command& command,
                Program& program) {
    const auto note = [&](const std::vector<std::string>& options, const char* why) {
        if (!options.empty())
            program.job.note(fmt::format("{} {} not used: {}", fmt::join(options, ", "),
                                         options.size() == 1 ? "is" : "are", why));
    };
    if (std::holds_alternative<Mesh>(model)) {
        note(command.given({"--mode", "--backend", "--device", "--pipeline", "--splat",
                            "--splat-coefficient", "--fill", "--match-colours", "--refine",
                            "--without", "--explain"}),
             "a mesh is rasterised itself, on the processor");
        return;
    }
    note(command.given({"--texture"}), "only meshes take a texture");
    if (o.settings.mode == RenderMode::splat)
        note(command.given({"--quality"}), "it is of --mode surface");
    else
        note(command.given({"--splat", "--splat-coefficient", "--pipeline"}),
             "they are of --mode splat");
}

Result<RenderSettings> settingsOf(const RenderOptions& o) {
    RenderSettings s = o.settings;
    s.fill = fillOf(o.background).value_or(s.fill);
    // Who asks for another background does not want the scene's own.
    s.ownEnvironment =
        !o.environment.given() && (o.background.empty() || o.background == "temporal");
    // What only OpenEXR can hold.
    if (const auto format = frameFormat(o.output); format && *format == FrameFormat::exr)
        s.normals = true;
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
    for (const auto& [option, value] : {std::pair{"--shininess", o.shininess},
                                        std::pair{"--splat-coefficient", s.splatCoefficient}}) {
        if (!std::isfinite(value))
            return fail(ErrorCode::usage, "{} is {}; a finite number is expected", option, value);
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

/// Under --no-clobber: errors when one of the pictures exists.
Result<void> checkFrames(const RenderOptions& o, int count, const Program& program) {
    if (!program.common.noClobber || o.skipExisting) return {};
    const auto part = o.shard.rangeOf(static_cast<std::size_t>(count));
    for (std::size_t i = part.first; i < part.end; ++i) {
        if (const auto name = frameName(o.output, static_cast<int>(i)))
            STX_CHECK(checkTarget(*name, program));
    }
    return {};
}

/// What is drawn.
struct DrawnScene {
    Model model;  ///< of what stands still
    std::unique_ptr<Renderer> still;
    std::unique_ptr<MovingPictures> moving;
    CameraContext context;
    std::int64_t points = 0;
    bool environment = false;  ///< pixels without the object show one
};

/// Opens the input: as a sequence when times are asked for.
Result<DrawnScene> openScene(const RenderOptions& o, const RenderSettings& settings,
                             const Command& command, Program& program) {
    DrawnScene scene;
    if (o.time.any()) {
        STX_TRY(auto frames, openSequence(o.input, o.open, program.job));
        scene.moving = std::make_unique<MovingPictures>(std::move(frames), settings, o.backend,
                                                        o.device, program.job);
        if (lightsByEnvironment(o)) scene.moving->lightByEnvironment();
        STX_TRY(const auto times, timesOf(o.time, scene.moving->timeline()));
        STX_CHECK(scene.moving->at(times.front(), {}));
        scene.context.views = scene.moving->views();
        scene.context.bounds = scene.moving->bounds();
        scene.context.origin = scene.moving->origin();
        scene.environment = settings.environment || scene.moving->environment();
        noteUnused(Bundle(), o, command, program);
        return scene;
    }
    STX_TRY(scene.model, stx::open(o.input, o.open, program.job));
    noteUnused(scene.model, o, command, program);
    const auto addViews = [&](const auto& seen) {
        for (const auto& v : seen.views) scene.context.views.push_back(v.camera);
        scene.points = seen.pointCount();
        scene.environment = settings.ownEnvironment && seen.environment;
    };
    if (const auto* mesh = std::get_if<Mesh>(&scene.model)) STX_CHECK(mesh->check());
    if (const auto* bundle = std::get_if<Bundle>(&scene.model)) addViews(*bundle);
    if (const auto* atlas = std::get_if<Atlas>(&scene.model)) addViews(*atlas);
    scene.environment = scene.environment || settings.environment;
    scene.context.bounds = boundsOf(scene.model);
    scene.context.origin = originOf(scene.model);
    return scene;
}

/// A picture for each camera, for each time, or for each pair of them.
Result<std::vector<NovelCamera>> picturesOf(const RenderOptions& o, const DrawnScene& scene,
                                            Program& program) {
    STX_TRY(auto cameras, makeCameras(o.camera, scene.context, program));
    if (!scene.moving) return cameras;
    const auto noted = [&](std::vector<NovelCamera> pictures) {
        std::vector<double> times;
        for (const NovelCamera& picture : pictures) times.push_back(*picture.time);
        noteOutside(times, scene.moving->timeline(), program.job);
        return pictures;
    };
    const bool timed =
        std::ranges::all_of(cameras, [](const auto& c) { return c.time.has_value(); });
    // `--times cameras`: a file of cameras may say when.
    if (o.time.times == "cameras") {
        if (timed) return noted(std::move(cameras));
        return fail(ErrorCode::usage, "--times cameras: the cameras have no times of their own");
    }
    STX_TRY(const auto times, timesOf(o.time, scene.moving->timeline()));
    if (cameras.size() > 1 && times.size() > 1 && cameras.size() != times.size())
        return fail(ErrorCode::usage,
                    "{} cameras and {} times; one camera, one time, or as many of both are "
                    "expected",
                    cameras.size(), times.size());
    std::vector<NovelCamera> pictures;
    for (std::size_t i = 0; i < std::max(cameras.size(), times.size()); ++i) {
        pictures.push_back(cameras[cameras.size() == 1 ? 0 : i]);
        pictures.back().time = times[times.size() == 1 ? 0 : i];
    }
    return noted(std::move(pictures));
}

/// The times of pictures as a clock; nothing where they do not ascend.
std::optional<Timeline> clockOf(const std::vector<NovelCamera>& pictures) {
    Timeline line;
    line.times.clear();
    for (const NovelCamera& picture : pictures) line.times.push_back(picture.time.value_or(0));
    line.end = line.times.empty() ? 0 : line.times.back();
    if (!line.moves() || !line.check()) return std::nullopt;
    line.findTick();
    return line;
}

/// The camera of a reference view, which may move, in a picture as large as `picture`.
Camera ofView(const std::vector<Camera>& views, const RenderOptions& o, const Camera& picture) {
    return inPicture(views[static_cast<std::size_t>(o.camera.view)],
                     glm::ivec2(picture.width, picture.height));
}

/// Lights by an environment: the one that is shown, else the model's own.
Result<void> lightBy(const Model& model, RenderSettings& settings, Job& job) {
    std::shared_ptr<const Environment> own;
    if (const auto* bundle = std::get_if<Bundle>(&model)) own = bundle->environment;
    if (const auto* atlas = std::get_if<Atlas>(&model)) own = atlas->environment;
    auto map = settings.environment;
    if (!map && own) {
        STX_TRY(map, EnvironmentMap::make(*own, job.limits));
        if (settings.ownEnvironment) settings.environment = map;
    }
    STX_TRY(settings.lighting.environment,
            environmentLight(std::move(map), settings.lighting, job.limits));
    return {};
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
                    "--size is {}x{}; an equirectangular picture is twice as wide as high", size.x,
                    size.y);
    return {};
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
    STX_TRY(const auto background, parseBackground(o.background));
    STX_CHECK(checkTarget(o.output, program));
    STX_TRY(const int wanted, checkCameraOptions(o.camera, command, program));
    if (wanted > 1 && !frameName(o.output, 0) && o.output != "-")
        return fail(ErrorCode::usage,
                    "{} pictures need a numbered name, as in -o 'name_%04d.png' (a film: -o - "
                    "--file-format y4m)",
                    wanted);
    STX_CHECK(checkFrames(o, wanted, program));
    FrameWriter::Settings writing;
    writing.pattern = o.output;
    writing.background = background;
    writing.stream = o.fileFormat;
    STX_TRY(writing.rate, parseRate(o.framesPerSecond.empty() ? "25" : o.framesPerSecond));
    writing.compression = o.compression;
    writing.around = o.around;
    writing.noClobber = program.common.noClobber;
    STX_CHECK(FrameWriter::check(writing));

    keepFreedMemory();
    preloadCodecs(o.input);
    STX_TRY(const auto around, environmentOf(o.environment, program.job));
    if (around) {
        STX_TRY(settings.environment, EnvironmentMap::make(*around, program.job.limits));
    }
    STX_TRY(auto scene, openScene(o, settings, command, program));
    CameraContext& context = scene.context;
    std::size_t at = 0;
    for (const std::string& light : o.lights) {
        if (light == kEnvironmentLight) continue;
        STX_TRY(settings.lighting.lights[at++], parseLight(light, context.origin));
    }
    if (lightsByEnvironment(o) && !scene.moving)
        STX_CHECK(lightBy(scene.model, settings, program.job));
    STX_TRY(const auto pictures, picturesOf(o, scene, program));
    const auto count = static_cast<int>(pictures.size());
    if (count > 1 && !frameName(o.output, 0) && o.output != "-")
        return fail(ErrorCode::usage,
                    "{} pictures need a numbered name, as in -o 'name_%04d.png' (a film: -o - "
                    "--file-format y4m)",
                    count);
    STX_CHECK(checkFrames(o, count, program));
    for (std::size_t i = 0; i < pictures.size(); ++i) {
        const Camera& camera = pictures[i].camera;
        if (auto ok = camera.check(); !ok)
            return tl::unexpected(ok.error().at(fmt::format("camera {}", i)));
        STX_CHECK(program.job.limits.checkAllocation(
            static_cast<std::uint64_t>(camera.width) * camera.height, 64, "the picture"));
    }
    if (scene.moving && scene.moving->timeline().moves() && o.output == "-" &&
        o.framesPerSecond.empty()) {
        if (o.time.times == "all")
            writing.rate =
                streamRateOf(scene.moving->timeline(), "frames of the film", program.job);
        if (const auto clock = clockOf(pictures); clock && o.time.times == "cameras")
            writing.rate = streamRateOf(*clock, "pictures of the cameras", program.job);
    }
    if (!scene.moving) {
        STX_TRY(scene.still,
                rendererOf(std::move(scene.model), settings, program.job, o.backend, o.device));
    }
    program.sayNotes();

    FrameWriter writer(writing, program.job);
    auto views = nlohmann::ordered_json::array();
    double total = 0;
    int drawn = 0, empty = 0;
    Renderer* renderer = scene.still.get();
    const auto part = o.shard.rangeOf(pictures.size());
    for (std::size_t i = part.first; i < part.end; ++i) {
        const auto name = writer.nameOf(static_cast<int>(i));
        std::error_code ec;
        if (o.skipExisting && o.output != "-" && std::filesystem::exists(name, ec)) {
            views.push_back({{"output", name}, {"skipped", true}});
            if (o.shard.given) views.back()["index"] = i;
            continue;
        }
        STX_CHECK(program.job.checkCancelled());
        const bool more = !o.skipExisting && i + 1 < part.end;
        Camera camera = pictures[i].camera;
        if (scene.moving) {
            auto now = scene.moving->at(*pictures[i].time,
                                        more ? pictures[i + 1].time : std::optional<double>());
            if (!now) return tl::unexpected(now.error().at(fmt::format("picture {}", i)));
            renderer = *now;
            if (o.camera.view >= 0) camera = ofView(scene.moving->views(), o, camera);
        } else if (more && !o.around) {
            renderer->expect(pictures[i + 1].camera);
        }
        const auto start = std::chrono::steady_clock::now();
        auto frame = o.around
                         ? renderAround(*renderer, camera, camera.width, camera.height, program.job)
                         : renderer->render(camera);
        if (!frame) return tl::unexpected(frame.error().at(fmt::format("picture {}", i)));
        const double milliseconds =
            std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
                .count();
        total += milliseconds;
        ++drawn;
        views.push_back({{"output", name}, {"milliseconds", milliseconds}});
        if (scene.moving) views.back()["time"] = *pictures[i].time;
        if (o.shard.given) views.back()["index"] = i;
        const bool nothing =
            scene.environment
                ? std::ranges::none_of(frame->depth.pixels(), [](float d) { return hasPoint(d); })
                : std::ranges::all_of(frame->colour.pixels(),
                                      [](glm::vec4 c) { return !(c.a > 0); });
        if (nothing) ++empty;
        STX_CHECK(writer.write(static_cast<int>(i), *frame, camera));
        renderer->reuse(std::move(*frame));
        program.job.progress(static_cast<std::int64_t>(i - part.first) + 1,
                             static_cast<std::int64_t>(part.end - part.first), "rendering");
    }
    STX_CHECK(writer.finish());
    if (empty > 0)
        program.job.note(fmt::format(
            "{} {} nothing{}: the object is behind or beside the camera; 'stx info' tells its "
            "bounds",
            counted(static_cast<std::size_t>(empty), "picture"), empty == 1 ? "shows" : "show",
            scene.environment ? " but the environment" : ""));
    program.sayNotes();
    program.say(fmt::format(
        "{} → {}, {} {}x{}, {}{}{}", std::filesystem::path(o.input).filename().string(), o.output,
        counted(part.end - part.first, "picture"), pictures[0].camera.width,
        pictures[0].camera.height, renderer ? renderer->backend() : "",
        drawn > 0 ? fmt::format(", {:.1f} ms each", total / drawn) : "",
        static_cast<std::size_t>(drawn) < part.end - part.first
            ? fmt::format(", {} skipped", part.end - part.first - static_cast<std::size_t>(drawn))
            : ""));
    nlohmann::ordered_json report = {
        {"$schema", "render-report.schema.json"},
        {"backend", renderer ? renderer->backend() : ""},
        {"device", renderer ? renderer->device() : ""},
        {"mode", settings.mode == RenderMode::splat ? "splat" : "surface"},
        {"points", scene.moving ? scene.moving->points() : scene.points},
        {"views", views}};
    if (o.shard.given) report["shard"] = shardJson(o.shard, pictures.size());
    if (settings.log) {
        report["stages"] = stagesJson(*settings.log);
        const std::string text = explained(*settings.log, static_cast<std::size_t>(drawn));
        // Where the pictures go to stdout it is for a person beside them.
        o.output == "-" ? program.say(text) : program.print(text);
    }
    STX_CHECK(program.writeReport(report));
    return 0;
}

}  // namespace

void addRender(CommandLine& line, Program& program) {
    Command c = line.add(
        "render",
        "Novel views of a bundle, an atlas or a mesh\n\n"
        "  stx render model.mp4 -o view.png --eye 0,1,4 --target 0,0,0\n"
        "  stx render atlas -o orbit_%04d.png --orbit 60 --elevation 20\n"
        "  stx render model.exr -o - --orbit 250 --file-format y4m | ffmpeg -i - orbit.mp4");
    auto o = std::make_shared<RenderOptions>();
    c.option("IN", o->input, "Bundle, atlas or mesh");
    c.option("-o,--output", o->output,
             ".png, .jpg, .exr, .tif or .webp; name_%04d.png for several; - for a y4m stream")
        .takes("IMAGE");
    addCameraOptions(c, o->camera);
    c.choice<bool>("--projection", o->around, {{"perspective", false}, {"equirectangular", true}},
                   "equirectangular: all that is seen from the camera's place, 360 by 180 degrees, "
                   "what it looks at in the middle (1024x512 by default); in .exr Z is the length "
                   "of the ray, and 'stx convert --from panorama' reads it back (default: as the "
                   "camera is)")
        .group("Camera");
    c.option("--time", o->time.time,
             "The moment of an input that moves, in seconds by its own clock, which stx info "
             "tells (default: its first)")
        .takes("T")
        .group("Time");
    c.option(
         "--times", o->time.times,
         "A picture for each frame from A to B seconds, or each STEP seconds between; all: each "
         "frame; cameras: the times of the --cameras file. With several cameras: as many")
        .takes("A:B[:STEP]|all|cameras")
        .group("Time");
    const char* drawing = "Drawing";
    c.choice<Backend>("--backend", o->backend,
                      {{"auto", Backend::automatic},
                       {"gpu", Backend::gpu},
                       {"gl", Backend::gl},
                       {"cpu", Backend::cpu}},
                      "auto, gpu, gl or cpu (default auto: a real GPU, else cpu)")
        .group(drawing);
    c.option("--device", o->device, "Number of the GPU to use, see --list-devices").group(drawing);
    c.flag("--list-devices", o->listDevices, "Print the GPUs there are and stop").group(drawing);
    c.choice<GpuPipeline>(
         "--pipeline", o->settings.pipeline,
         {{"auto", GpuPipeline::automatic},
          {"compute", GpuPipeline::compute},
          {"raster", GpuPipeline::raster}},
         "Of splats on a GPU: auto, compute (atomics; OpenGL 4.5) or raster (vertex texture "
         "fetch; OpenGL 3.3) (default auto: by what the device has)")
        .group(drawing);
    c.choice<RenderMode>("--mode", o->settings.mode,
                         {{"surface", RenderMode::surface}, {"splat", RenderMode::splat}},
                         "surface: best pictures; splat: the paper's (default surface)")
        .group(drawing);
    c.choice<Quality>(
         "--quality", o->settings.quality,
         {{"draft", Quality::draft}, {"normal", Quality::normal}, {"best", Quality::best}},
         "Of surface mode: draft, normal or best (default normal)")
        .group(drawing);
    c.choice<SplatRule>(
         "--splat", o->settings.splat,
         {{"data", SplatRule::data}, {"paper", SplatRule::paper}, {"point", SplatRule::point}},
         "Size and shape of splats: data, paper or point (default data)")
        .group(drawing);
    c.option("--splat-coefficient", o->settings.splatCoefficient,
             "Of --splat paper: pixels times scene units (default: fitted)")
        .notNegative()
        .group(drawing);
    c.choice<Fill>("--fill", o->settings.fill,
                   {{"background", Fill::background}, {"none", Fill::none}},
                   "What no view shows: background (--background temporal) or none (default "
                   "background)")
        .group(drawing);
    c.choice<bool>("--match-colours", o->matchColours, {{"auto", true}, {"off", false}},
                   "Gains and offsets between views that differ clearly where they show the same "
                   "surface (exposure, white balance): auto brings them to those of most, off "
                   "leaves them (default auto)")
        .group(drawing);
    refineOption(c, o->refine).group(drawing);
    c.option(
         "--without", o->without,
         "Leave out stages, with commas between them: " + stageNames() + ", and those of --refine")
        .takes("STAGES")
        .group(drawing);
    c.flag("--explain", o->explain,
           "Print what each stage takes and how many pixels it changes (in the report, too)")
        .group(drawing);
    c.option("--background", o->background,
             "What stands where no view shows a surface. temporal: the bundle's background views, "
             "then what is around, in scenes that fill the frame (default); spatial: what is "
             "around only; none: nothing, alpha is kept. Or a colour behind all of it: values of 0 "
             "to 1, #rrggbb or a name such as white")
        .takes("temporal|spatial|none|COLOUR")
        .group(drawing);
    addEnvironmentOptions(
        c, o->environment, "Environment: what is behind everything, infinitely far away",
        "Shown where nothing covers a pixel: an equirectangular picture, an OpenEXR file with "
        "envmap, a folder of six faces, or a scene with a Background; none: not even the scene's "
        "own, which is shown otherwise (but with --background spatial, none or a colour)");
    const char* lighting = "Lighting (Phong, in linear light; off without --light)";
    c.option("--light", o->lights,
             "dir:X,Y,Z[,r,g,b] shines along X,Y,Z; point:X,Y,Z[,r,g,b] is at X,Y,Z; @camera "
             "appended: in camera space; environment: diffuse and glossy light from all around, of "
             "--environment or the scene's own. Repeat for more")
        .takes("LIGHT")
        .group(lighting);
    c.option("--ambient", o->ambient,
             "Ambient light, grey or r,g,b (default 0.2; 0 with --light environment)")
        .group(lighting);
    c.option("--specular", o->specular, "Specular reflection, grey or r,g,b (default 0)")
        .group(lighting);
    c.option("--shininess", o->shininess, "Phong exponent, above 0 (default 32)")
        .positive()
        .group(lighting);
    const char* output = "Output";
    c.option("--file-format", o->fileFormat, "Of a stream on stdout: y4m")
        .oneOf({"y4m"})
        .group(output);
    c.option("--format", o->fileFormat, "The same as --file-format").oneOf({"y4m"}).group(output);
    c.option("--compression", o->compression,
             "Of .png, 0 to 9: 1 takes least time, 9 makes files a tenth smaller (default 1)")
        .range(0, 9)
        .group(output);
    c.option(
         "--fps", o->framesPerSecond,
         "Frame rate written into the stream, as in 30 or 30000/1001 (default: of --times all the "
         "input's, of --times cameras theirs, else 25)")
        .takes("RATE")
        .group(output);
    c.flag("--skip-existing", o->skipExisting, "Leave pictures that exist as they are")
        .group(output);
    addShardOption(c, o->shard, "pictures", output);
    c.option("--texture", o->open.texture, "Texture of a mesh, in place of those that it names")
        .takes("IMAGE")
        .group(output);
    c.sharedOptions(program.common, kOutput | kOutside);
    c.runs([o, c](Program& p) { return render(*o, c, p); });
}

}  // namespace stx::tools
