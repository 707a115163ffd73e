#include "tools/mesh_views.hpp"

#include <filesystem>
#include <set>

#include "formats/imagesets/camera_file.hpp"
#include "formats/stx/mesh_views.hpp"
#include "lib/model/splat_cloud.hpp"
#include "tools/camera_options.hpp"

namespace stx::tools {
namespace {

/// What the options ask for; cameras of a file, which are in the world, as they are in it.
Result<ConvertSettings> settingsOf(const MeshViewOptions& o, Program& program) {
    ConvertSettings s;
    s.views = o.views;
    std::optional<glm::ivec2> size;
    if (!o.size.empty()) {
        STX_TRY(size, parseSize(o.size, program.job.limits));
        s.width = size->x;
        s.height = size->y;
    }
    if (!o.projection.empty()) s.orthographic = o.projection == "orthographic";
    if (!(o.fovDeg > 0 && o.fovDeg < 170))
        return fail(ErrorCode::usage, "--fov is {:g}; it must be above 0 and below 170 degrees",
                    o.fovDeg);
    s.fovRad = glm::radians(o.fovDeg);
    s.elevationRad = glm::radians(o.elevationDeg.value_or(15.0));
    if (!o.up.empty()) STX_SET(s.up, parseDirection(o.up, "--up"));
    if (o.supersampling) s.supersampling = *o.supersampling;
    s.depthBits = o.depthBits;
    s.meshNormals = o.normals == "mesh";
    s.materials = o.materials;
    return s;
}

/// The cameras of a file, where --views names one.
Result<std::vector<NamedCamera>> camerasOfFile(const MeshViewOptions& o, const Mesh& mesh,
                                               Program& program) {
    std::vector<NamedCamera> cameras;
    std::error_code ec;
    if (o.views.starts_with("auto") || parseViewLayout(o.views) ||
        !std::filesystem::exists(o.views, ec))
        return cameras;
    std::optional<glm::ivec2> size;
    if (!o.size.empty()) STX_SET(size, parseSize(o.size, program.job.limits));
    STX_TRY(cameras, readCameraFile(o.views, program.job, size));
    for (NamedCamera& named : cameras) {
        named.camera = inPicture(named.camera, size);
        named.camera.position -= mesh.origin;
    }
    return cameras;
}

/// The names of cameras, where each has one of its own; else none.
std::vector<std::string> namesOf(const std::vector<NamedCamera>& cameras) {
    std::vector<std::string> names;
    for (const NamedCamera& named : cameras)
        if (!named.name.empty()) names.push_back(named.name);
    const std::set<std::string_view> different(names.begin(), names.end());
    if (different.size() != cameras.size()) names.clear();
    return names;
}

/// How good the choice of `auto` views is.
void sayChoice(const MeshViews& views, Program& program) {
    const auto n = views.cameras.size();
    if (views.wanted.count == 0 && views.psnr >= views.wanted.decibels)
        program.say(fmt::format("{} {:.1f} dB in pictures from six sides",
                                n == 1 ? "1 view reaches" : fmt::format("{} views reach", n),
                                views.psnr));
    const Selection& s = *views.selection;
    const double quality = n > 0 && n <= s.quality.size() ? s.quality[n - 1] : 0.0;
    program.say(fmt::format(
        "{} of {} candidate views: {:.1f} % of the quality of all, at least {:.1f} % of the best "
        "possible choice; {:.1f} % of the surface is seen, {:.1f} % can never be",
        n, views.candidates, quality * 100, s.certificate * 100, s.coverage * 100,
        s.neverSeen * 100));
}

struct ChosenViews {
    ConvertSettings settings;
    MeshViews views;
};

/// The cameras that the options ask for; says how good the choice is, and draws its plot.
Result<ChosenViews> chooseMeshViews(const Mesh& mesh, const MeshViewOptions& o, Program& program) {
    STX_CHECK(mesh.check());
    ChosenViews chosen;
    STX_TRY(chosen.settings, settingsOf(o, program));
    STX_TRY(const auto named, camerasOfFile(o, mesh, program));
    for (const NamedCamera& one : named) chosen.settings.cameras.push_back(one.camera);
    chosen.settings.names = namesOf(named);
    if (mesh.splats && !chosen.settings.up && chosen.settings.cameras.empty())
        noteSplatsUp(mesh.splats->up, program.job);
    if (mesh.splats && o.supersampling)
        program.job.note("--supersampling is not used: splats are drawn with one sample a pixel");
    STX_TRY(chosen.views, chooseViews(mesh, chosen.settings, program.job));
    if (chosen.views.selection) {
        sayChoice(chosen.views, program);
        if (!o.plot.empty()) {
            const std::string svg =
                selectionPlotSvg(*chosen.views.selection, "quality against the number of views");
            STX_CHECK(writeFile(o.plot, std::as_bytes(std::span(svg)), program.outputOptions()));
        }
    }
    return chosen;
}

}  // namespace

void addMeshViewOptions(const Command& command, const std::shared_ptr<MeshViewOptions>& o) {
    Command c = command.under(MeshViewOptions::kHeading);
    c.option("--views", o->views,
             "cube, ring:N, sphere:N, octahedral:N, hemi-octahedral:N (grids of N x N), auto:N "
             "(the N best), auto:DBdB (the fewest that reach this PSNR) or a camera file "
             "(default sphere:16)")
        .reads("WORD");
    c.option("--size", o->size,
             "Size of each view (default 512x512; of a camera file: what it says)")
        .takes("WxH");
    c.option("--projection", o->projection,
             "perspective or orthographic (default perspective; cube: orthographic)")
        .oneOf({"perspective", "orthographic"});
    c.option("--elevation", o->elevationDeg, "Of a ring above the horizon, in degrees (default 15)")
        .range(-90.0, 90.0)
        .takes("DEG");
    c.option("--up", o->up,
             "The model's up axis, on which rings, spheres and octahedra stand: Z, X,Y,Z or "
             "with a minus --up=-Y (default Y; of Gaussian splats in PLY -Y, as in trained "
             "clouds)")
        .takes("AXIS");
    c.option("--fov", o->fovDeg,
             "Angle that the whole object fills, in degrees: sets the distance (default 35); of a "
             "photo: what its camera sees from bottom to top")
        .takes("DEG");
    c.option("--supersampling", o->supersampling,
             "Colour samples per pixel and axis, 1 to 8 (default 4)")
        .range(1, 8);
    c.option("--normals", o->normals,
             "mesh: keep the model's own normals (SimpleTextureV2); or none (default none)")
        .oneOf({"mesh", "none"});
    c.flag("--materials", o->materials,
           "Keep metallic-roughness (glTF) and the light that is given off as images of their "
           "own, for engines (.exr; from there atlases); colour is then without that light");
    c.option("--plot", o->plot, "With auto: draw quality against the number of views")
        .writes("FILE.svg");
    c.under("Coding")
        .option(
            "--depth-bits", o->depthBits,
            "8, 16 or 32 (float, .exr only); default 16 (image sets: 32 where 16 are too coarse)")
        .oneOf({8, 16, 32});
}

Result<void> checkMeshViewOptions(const MeshViewOptions& o, const Command& command,
                                  Program& program) {
    STX_TRY(const auto automatic, parseAutoViews(o.views));
    STX_CHECK(settingsOf(o, program));
    if (!automatic) STX_CHECK(command.refuse({"--plot"}, "is of --views auto:N"));
    STX_CHECK(checkPlotTarget("--plot", o.plot, program));
    const auto layout = parseViewLayout(o.views);
    if (automatic || (layout && layout->kind != ViewLayout::Kind::ring))
        STX_CHECK(command.refuse({"--elevation"}, "is of --views ring:N"));
    if (automatic || layout) return {};
    std::error_code ec;
    if (std::filesystem::exists(o.views, ec))
        return command.refuse({"--elevation", "--projection", "--fov", "--up"},
                              "does not go with a camera file, whose cameras have their own");
    // A word without a dot or a slash is meant as a layout.
    if (o.views.find_first_of("./") == std::string::npos) return tl::unexpected(layout.error());
    return fail(ErrorCode::io,
                "cannot read the camera file '{}' of --views: the file does not exist", o.views);
}

Result<Bundle> captureMesh(const Mesh& mesh, const MeshViewOptions& o, Program& program,
                           Selection* selection) {
    STX_TRY(auto chosen, chooseMeshViews(mesh, o, program));
    if (selection && chosen.views.selection) *selection = std::move(*chosen.views.selection);
    if (chosen.views.cameras.size() > 1) keepFreedMemory();
    STX_TRY(auto bundle, captureViews(mesh, chosen.views.cameras, chosen.settings, program.job));
    CodedDepth codes;
    for (const ReferenceView& view : bundle.views) codes.add(view);
    codes.note(program.job);
    return bundle;
}

Result<void> withMeshViews(
    const Mesh& mesh, const MeshViewOptions& o, Program& program,
    const std::function<Result<void>(std::unique_ptr<ViewTable> table, Job& job)>& use) {
    STX_TRY(const auto chosen, chooseMeshViews(mesh, o, program));
    CodedDepth codes;
    STX_CHECK(withViewsOf(mesh, chosen.views.cameras, chosen.settings, program.job,
                          [&](std::unique_ptr<ViewTable> table, Job& job) {
                              return use(watchedViews(std::move(table),
                                                      [&](std::size_t, const ReferenceView& view) {
                                                          codes.add(view);
                                                      }),
                                         job);
                          }));
    codes.note(program.job);
    return {};
}

}  // namespace stx::tools
