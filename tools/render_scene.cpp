#include "tools/render_scene.hpp"

#include <algorithm>
#include <functional>
#include <type_traits>
#include <utility>

#include "formats/any/open.hpp"
#include "formats/any/sequences.hpp"
#include "formats/files/files.hpp"
#include "formats/images/frames.hpp"
#include "formats/imagesets/set_views.hpp"
#include "lib/model/median_distance.hpp"
#include "lib/model/peak_memory.hpp"
#include "lib/model/splat_cloud.hpp"
#include "lib/refine/refine_needed.hpp"
#include "lib/render/factory.hpp"
#include "tools/drawn_views.hpp"
#include "tools/light_options.hpp"
#include "tools/refining.hpp"

namespace stx::tools {
namespace {

/// Notes options that do not matter to this model and mode: scripts pass them to all.
void noteUnused(const Model& model, const RenderOptions& o, const Command& command,
                Program& program) {
    const auto note = [&](const std::vector<std::string>& options, const char* why) {
        program.job.noteUnused(options, "", why);
    };
    if (o.open.timesFromStart) {  // asked first: headers of many views are much to read
        const auto kind = recognise(o.input);
        if (!o.open.set.from.empty() || !kind || *kind != FileKind::mpeg4)
            program.job.noteUnused(
                {"--times-from-start"}, "of MPEG-4 scenes",
                fmt::format("'{}' is {}", o.input, kind ? nameOf(*kind) : "none"));
    }
    if (std::holds_alternative<Mesh>(model)) {
        program.job.noteUnused(command.given({"--time", "--times"}), "of films",
                               fmt::format("'{}' is a mesh", o.input));
        note(command.given({"--mode", "--backend", "--device", "--pipeline", "--splat",
                            "--splat-coefficient", "--fill", "--match-colours", "--refine",
                            "--without", "--explain", "--quality"}),
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

/// The pose of the view that --sway is around.
template <class Views>
Result<SwayPose> swayPose(const CameraOptions& o, const Views& seen) {
    STX_TRY(const std::size_t number, namedView(o.view, seen.views));
    const ReferenceView& view = seen.views[number];
    SwayPose pose{view.camera};
    if constexpr (std::is_same_v<Views, Atlas>)
        pose.distance = medianDistance(seen, number);
    else
        pose.distance = medianDistance(view);
    if (!(pose.distance > 0))
        return fail(ErrorCode::invalidInput,
                    "view '{}' has no depth, so that --sway has no distance to go by", view.name);
    return pose;
}

/// Of a film: the pose of its first picture.
Result<SwayPose> swayPose(const RenderOptions& o, Sequence& frames, Job& job) {
    STX_TRY(const auto times, timesOf(o.time, frames.timeline()));
    Job quiet;  // the frame is read again when it is drawn, and says the same then
    quiet.workFor(job);
    STX_TRY(const auto bundle, frames.frame(frames.timeline().frameAt(times.front()), quiet));
    return swayPose(o.camera, bundle);
}

using LookAtView = std::function<Result<void>(std::size_t index, const ReferenceView& view)>;

/// Whether the views of a table that is exact may be chosen by the pictures that are wanted:
/// nothing looks at all of them first.
bool mayChoose(const RenderOptions& o, const ViewTable& table) {
    return !o.around && !(o.camera.swayPercent > 0) && table.about().bounds;
}

/// Opens what stands still. Views that would take more memory than there may be go into a spool,
/// from which a picture takes 7 to 30 % more time of processors (64 views of 1024x1024).
Result<void> openStill(const RenderOptions& o, const RenderSettings& settings, DrawnScene& scene,
                       Job& job) {
    STX_TRY(const auto kind, recognise(o.input));
    std::unique_ptr<ViewTable> table;
    if (!o.open.set.from.empty() || kind == FileKind::imageSet) {
        STX_CHECK(checkObject(o.input, FileKind::imageSet, o.open));
        // Of what fits each picture is read once.
        const ViewImageKinds usual;
        const std::uint64_t each = usual.bytesPerPixel(), drawn = drawingMemory(settings).perPixel;
        STX_TRY(table, openSetViews(o.input, o.open.set, job,
                                    job.limits.maxMemoryBytes / (each + drawn) * each));
    } else if (kind == FileKind::exr || kind == FileKind::mpeg4) {
        STX_TRY(table, openViews(o.input, o.open, job));
    } else {
        STX_TRY(scene.model, stx::open(o.input, o.open, job));
        return {};
    }
    scene.exact = tellWithoutPixels(table->about().views) && saidToBeExact(*table, settings.refine);
    if (scene.exact && mayChoose(o, *table)) {
        STX_TRY(scene.model,
                someViews(*table, std::vector<bool>(table->count(), false), nullptr, job));
        scene.table = std::move(table);
        scene.summaries = scene.table->summaries();
        return {};
    }
    if (table->whole()) {
        STX_TRY(scene.model, wholeBundle(std::move(table), job));
        return {};
    }
    STX_TRY(scene.model,
            viewsToDraw(*table, drawingMemory(settings), std::vector<bool>(table->count(), true),
                        folderBeside(o.output), scene.spool, job));
    return {};
}

std::int64_t pointsOf(const std::vector<ViewSummary>& summaries) {
    std::int64_t points = 0;
    for (const ViewSummary& s : summaries) points += s.points;
    return points;
}

/// The views of a table that pictures are drawn from. `settings`: those of makeStill().
std::vector<bool> wantedViews(const RenderOptions& o, const RenderSettings& settings,
                              const std::vector<NovelCamera>& pictures, const DrawnScene& scene) {
    std::vector<Camera> cameras;
    const auto part = o.shard.rangeOf(pictures.size());
    for (std::size_t i = part.first; i < part.end; ++i) cameras.push_back(pictures[i].camera);
    const auto& headers = std::get<Bundle>(scene.model).views;
    return neededViews(o.backend, o.device, headers, scene.summaries, settings, cameras);
}

/// What makeStill() draws with.
RenderSettings settingsOf(const RenderSettings& asked, const DrawnScene& scene) {
    RenderSettings settings = asked;
    if (scene.exact) settings.refine = RefineSettings::none();
    return settings;
}

/// Errors (usage): a film of pictures of two sizes.
Result<void> checkFilmSize(const RenderOptions& o, const std::vector<NovelCamera>& pictures) {
    if (o.output != "-" || o.fileFormat != "y4m" || pictures.empty()) return {};
    const Camera& first = pictures.front().camera;
    const auto other = std::ranges::find_if(pictures, [&](const NovelCamera& p) {
        return p.camera.width != first.width || p.camera.height != first.height;
    });
    if (other == pictures.end()) return {};
    return fail(ErrorCode::usage,
                "a film has pictures of one size, and camera 0 is {}x{}, camera {} {}x{}; give "
                "--size",
                first.width, first.height, other - pictures.begin(), other->camera.width,
                other->camera.height);
}

}  // namespace

Result<void> checkPictures(const RenderOptions& o, const RenderSettings& asked,
                           const std::vector<NovelCamera>& pictures, const DrawnScene& scene,
                           const Limits& limits) {
    constexpr std::uint64_t kBytesPerPixel = 64;
    std::uint64_t largest = 0;
    for (std::size_t i = 0; i < pictures.size(); ++i) {
        const Camera& camera = pictures[i].camera;
        STX_CHECK(within(fmt::format("camera {}", i), camera.check()));
        if (o.output != "-") STX_CHECK(checkFrameSize(o.output, camera.width, camera.height));
        largest = std::max(largest, static_cast<std::uint64_t>(camera.width) * camera.height);
    }
    STX_CHECK(checkFilmSize(o, pictures));
    auto fits = limits.checkAllocation(largest, kBytesPerPixel, "the picture");
    if (fits || !scene.table) return fits;
    const RenderSettings settings = settingsOf(asked, scene);
    const auto wanted = wantedViews(o, settings, pictures, scene);
    Limits ofPicture = limits;
    ofPicture.maxMemoryBytes = largest * kBytesPerPixel;
    if (checkDrawing(*scene.table, drawingMemory(settings), wanted, ofPicture)) return fits;
    return checkDrawing(*scene.table, drawingMemory(settings), wanted, limits);
}

namespace {

/// Lights that are in the world, from an origin.
Result<void> placeLights(const RenderOptions& o, glm::dvec3 origin, RenderSettings& settings) {
    std::size_t at = 0;
    for (const std::string& light : o.lights) {
        if (light == kEnvironmentLight) continue;
        STX_TRY(settings.lighting.lights[at++], parseLight(light, origin));
    }
    return {};
}

/// What moves, and what is asked for as if it did.
Result<DrawnScene> openMoving(const RenderOptions& o, RenderSettings& settings,
                              const Command& command, Program& program) {
    DrawnScene scene;
    STX_TRY(auto frames, openSequence(o.input, o.open, program.job));
    if (!frames->timeline().moves())
        program.job.noteUnused(command.given({"--time", "--times"}), "of films",
                               fmt::format("'{}' does not move", o.input));
    if (o.camera.swayPercent > 0) STX_SET(scene.context.sway, swayPose(o, *frames, program.job));
    STX_TRY(const auto times, timesOf(o.time, frames->timeline()));
    if (!settings.lighting.lights.empty()) {
        // All frames count from one origin, and each is drawn with the lights as they are here.
        Job quiet;  // the frame is read again when it is drawn, and says the same then
        quiet.workFor(program.job);
        STX_TRY(const auto first, frames->views(frames->timeline().frameAt(times.front()), quiet));
        STX_CHECK(placeLights(o, std::as_const(*first).about().origin, settings));
    }
    scene.moving = std::make_unique<MovingPictures>(std::move(frames), settings, o.backend,
                                                    o.device, folderBeside(o.output), program.job);
    if (lightsByEnvironment(o)) scene.moving->lightByEnvironment();
    STX_CHECK(scene.moving->at(times.front(), {}));
    scene.context.views = scene.moving->views();
    scene.context.moved = MovesOfNeighbours(scene.moving->moved());
    scene.context.bounds = scene.moving->bounds();
    scene.context.origin = scene.moving->origin();
    scene.environment = settings.environment || scene.moving->environment();
    noteUnused(Bundle(), o, command, program);
    return scene;
}

}  // namespace

Result<DrawnScene> openScene(const RenderOptions& o, RenderSettings& settings,
                             const Command& command, Program& program) {
    // A mesh is not a sequence; whatever else does not move is one of a single frame.
    const auto kind = recognise(o.input);
    const bool ofMesh = o.open.set.from.empty() && kind && *kind == FileKind::mesh;
    if (o.time.any() && !ofMesh) return openMoving(o, settings, command, program);
    DrawnScene scene;
    const bool sways = o.camera.swayPercent > 0;
    STX_CHECK(openStill(o, settings, scene, program.job));
    noteUnused(scene.model, o, command, program);
    const auto addViews = [&](const auto& seen) -> Result<void> {
        for (const auto& v : seen.views) scene.context.views.push_back(v.camera);
        scene.context.moved = MovesOfNeighbours(movedCameras(seen.views));
        scene.points = scene.table ? pointsOf(scene.summaries) : seen.pointCount();
        scene.environment = settings.ownEnvironment && seen.environment;
        if (sways) STX_SET(scene.context.sway, swayPose(o.camera, seen));
        return {};
    };
    if (const auto* mesh = std::get_if<Mesh>(&scene.model)) {
        if (sways)
            return fail(ErrorCode::usage,
                        "--sway moves around the pose of a reference view, and a mesh has none; "
                        "--orbit goes around it");
        STX_CHECK(mesh->check());
        if (mesh->splats) {
            scene.context.up = mesh->splats->up;
            if (!o.lights.empty())
                program.job.note(
                    "splats have their light in their colours, and --light changes nothing; views "
                    "of them (stx convert) can be lit");
        }
    }
    if (const auto* bundle = std::get_if<Bundle>(&scene.model)) STX_CHECK(addViews(*bundle));
    if (const auto* atlas = std::get_if<Atlas>(&scene.model)) STX_CHECK(addViews(*atlas));
    scene.environment = scene.environment || settings.environment;
    scene.context.bounds = boundsOf(scene.model);
    scene.context.origin = originOf(scene.model);
    STX_CHECK(placeLights(o, scene.context.origin, settings));
    return scene;
}

Result<void> makeStill(const RenderOptions& o, const RenderSettings& asked,
                       const std::vector<NovelCamera>& pictures, DrawnScene& scene, Job& job) {
    const RenderSettings settings = settingsOf(asked, scene);
    if (scene.table) {
        const auto wanted = wantedViews(o, settings, pictures, scene);
        const auto check = [&](std::size_t index, const ReferenceView& view) -> Result<void> {
            if (mayBeSummaryOf(scene.summaries[index], view)) return {};
            return failAt(fmt::format("{}: view {}", scene.table->where(), index),
                          ErrorCode::invalidInput,
                          "its summary is not that of its pixels: the file is damaged; write it "
                          "anew (stx refine)");
        };
        // Where all views are read their summaries tell nothing.
        const bool all = std::ranges::find(wanted, false) == wanted.end();
        STX_TRY(scene.model,
                viewsToDraw(*scene.table, drawingMemory(settings), wanted, folderBeside(o.output),
                            scene.spool, job, all ? LookAtView() : LookAtView(check)));
        scene.table.reset();
        if (!all) {
            STX_TRY(scene.still, makeRenderer(std::get<Bundle>(scene.model), scene.summaries,
                                              scene.spool.get(), settings, job));
            return {};
        }
    }
    if (scene.spool)
        STX_SET(scene.still, makeRenderer(o.backend, std::get<Bundle>(scene.model), *scene.spool,
                                          settings, o.device, job));
    else
        STX_SET(scene.still,
                rendererOf(std::move(scene.model), settings, job, o.backend, o.device));
    return {};
}

Result<std::vector<NovelCamera>> picturesOf(const RenderOptions& o, const DrawnScene& scene,
                                            Program& program) {
    CameraOptions wanted = o.camera;
    if (scene.moving && wanted.swayPercent > 0 && wanted.swayFrames == 0) {
        STX_TRY(const auto times, timesOf(o.time, scene.moving->timeline()));
        if (times.size() > 1) wanted.swayFrames = static_cast<int>(times.size());
    }
    STX_TRY(auto cameras, makeCameras(wanted, scene.context, program));
    if (!scene.moving) return cameras;
    const auto noted = [&](std::vector<NovelCamera> pictures) {
        std::vector<double> times;
        times.reserve(pictures.size());
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

std::optional<Timeline> clockOf(const std::vector<NovelCamera>& pictures) {
    Timeline line;
    line.times.clear();
    for (const NovelCamera& picture : pictures) line.times.push_back(picture.time.value_or(0));
    line.end = line.times.empty() ? 0 : line.times.back();
    if (!line.moves() || !line.check()) return std::nullopt;
    line.findTick();
    return line;
}

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

}  // namespace stx::tools
