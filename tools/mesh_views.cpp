#include "tools/mesh_views.hpp"

#include <charconv>
#include <filesystem>
#include <numbers>

#include "formats/imagesets/camera_file.hpp"
#include "lib/quality/capture_quality.hpp"
#include "lib/selection/selection.hpp"
#include "tools/camera_options.hpp"

namespace stx::tools {
namespace {

constexpr int kMostAutoViews = 64;  // that auto:DBdB may come to

/// `auto:N`, or `auto:DBdB` with a quality in decibels.
struct AutoViews {
    int count = 0;
    double decibels = 0;
};

Result<std::optional<AutoViews>> parseAuto(const std::string& text) {
    if (text.rfind("auto", 0) != 0) return std::optional<AutoViews>();
    const auto complain = [&] {
        return fail(ErrorCode::usage,
                    "--views is '{}'; auto:N for the N best views (1 to 4096) or auto:DBdB for the "
                    "fewest that "
                    "reach a quality, as in auto:38dB, is expected",
                    text);
    };
    if (text.size() < 6 || text[4] != ':') return complain();
    std::string_view number = std::string_view(text).substr(5);
    AutoViews result;
    if (number.size() > 2 && (number.ends_with("dB") || number.ends_with("db"))) {
        number.remove_suffix(2);
        const auto parsed =
            std::from_chars(number.data(), number.data() + number.size(), result.decibels);
        if (parsed.ec != std::errc() || parsed.ptr != number.data() + number.size() ||
            !(result.decibels > 0 && result.decibels < 100))
            return complain();
        return std::optional<AutoViews>(result);
    }
    const auto parsed = std::from_chars(number.data(), number.data() + number.size(), result.count);
    if (parsed.ec != std::errc() || parsed.ptr != number.data() + number.size() ||
        result.count < 1 || result.count > 4096)
        return complain();
    return std::optional<AutoViews>(result);
}

Result<ViewFraming> framingOf(const MeshViewOptions& o, bool cube, Program& program) {
    ViewFraming framing;
    STX_TRY(const auto size, parseSize(o.size.empty() ? "512x512" : o.size, program.job.limits));
    framing.width = size.x;
    framing.height = size.y;
    // The six faces of a cube are orthographic in the standard's own example.
    framing.orthographic = o.projection == "orthographic" || (o.projection.empty() && cube);
    if (!(o.fovDeg > 0 && o.fovDeg < 170))
        return fail(ErrorCode::usage, "--fov is {:g}; it must be above 0 and below 170 degrees",
                    o.fovDeg);
    framing.fovRad = o.fovDeg * std::numbers::pi / 180.0;
    STX_TRY(framing.up, parseDirection(o.up, "--up"));
    return framing;
}

Result<std::vector<Camera>> autoCameras(const Mesh& mesh, const AutoViews& wanted,
                                        const MeshViewOptions& o, const CaptureSettings& capture,
                                        Program& program, Selection* selection) {
    MeshCandidates candidates;
    STX_TRY(candidates.framing, framingOf(o, false, program));
    SelectSettings select;
    select.count = wanted.count > 0 ? wanted.count : kMostAutoViews;
    candidates.directions = std::max(candidates.directions, std::min(4096, 2 * select.count));
    STX_TRY(auto chosen, selectMeshViews(mesh, candidates, select, program.job));
    auto cameras = std::move(chosen.cameras);
    if (wanted.count == 0) {
        const auto most = cameras.size();
        STX_TRY(const auto fewest,
                fewestCameras(mesh, cameras, capture, wanted.decibels, program.job));
        cameras.resize(fewest.count);
        const std::string reached = fmt::format(
            "{} {:.1f} dB",
            fewest.count == 1 ? "1 view reaches" : fmt::format("{} views reach", fewest.count),
            fewest.psnr);
        if (fewest.psnr < wanted.decibels)
            program.job.note(
                fmt::format("{:g} dB is not reached by {}, the most that are tried; {}",
                            wanted.decibels, counted(most, "view"), reached));
        else
            program.say(reached + " in pictures from six sides");
    }
    const auto& s = chosen.selection;
    const auto n = cameras.size();
    const double quality = n > 0 && n <= s.quality.size() ? s.quality[n - 1] : 0.0;
    program.say(fmt::format(
        "{} of {} candidate views: {:.1f} % of the quality of all, at least {:.1f} % of the best "
        "possible choice; {:.1f} % of the surface is seen, {:.1f} % can never be",
        n, candidates.directions, quality * 100, s.certificate * 100, s.coverage * 100,
        s.neverSeen * 100));
    if (!o.plot.empty()) {
        const std::string svg = selectionPlotSvg(s, "quality against the number of views");
        STX_CHECK(writeFile(o.plot, std::as_bytes(std::span(svg)), program.outputOptions()));
    }
    if (selection) *selection = s;
    return cameras;
}

Result<std::vector<Camera>> layoutOrFile(const Mesh& mesh, const MeshViewOptions& o,
                                         Program& program) {
    std::error_code ec;
    auto layout = parseViewLayout(o.views);
    if (!layout) {
        if (!std::filesystem::exists(o.views, ec)) return propagate(layout);
        std::optional<glm::ivec2> size;
        if (!o.size.empty()) {
            STX_TRY(size, parseSize(o.size, program.job.limits));
        }
        STX_TRY(const auto named, readCameraFile(o.views, program.job, size));
        std::vector<Camera> cameras;
        for (const auto& n : named) {
            cameras.push_back(inPicture(n.camera, size));
            cameras.back().position -= mesh.origin;
        }
        return cameras;
    }
    STX_TRY(const auto framing, framingOf(o, layout->kind == ViewLayout::Kind::cube, program));
    layout->elevationRad = o.elevationDeg.value_or(15.0) * std::numbers::pi / 180.0;
    return layoutCameras(*layout, framing, drawnPoints(mesh));
}

}  // namespace

void addMeshViewOptions(Command command, const std::shared_ptr<MeshViewOptions>& o) {
    const char* group = MeshViewOptions::kHeading;
    command
        .option("--views", o->views,
                "cube, ring:N, sphere:N, octahedral:N, auto:N (the N best), auto:DBdB (the "
                "fewest that reach "
                "this PSNR) or a camera file (default sphere:16)")
        .group(group);
    command
        .option("--size", o->size,
                "Size of each view (default 512x512; of a camera file: what it says)")
        .takes("WxH")
        .group(group);
    command
        .option("--projection", o->projection,
                "perspective or orthographic (default perspective; cube: orthographic)")
        .oneOf({"perspective", "orthographic"})
        .group(group);
    command
        .option("--elevation", o->elevationDeg,
                "Of a ring above the horizon, in degrees (default 15)")
        .range(-90.0, 90.0)
        .takes("DEG")
        .group(group);
    command
        .option("--up", o->up,
                "The model's up axis, on which rings, spheres and octahedra stand: Z, X,Y,Z or "
                "with a minus --up=-Y (default Y)")
        .takes("AXIS")
        .group(group);
    command
        .option("--fov", o->fovDeg,
                "Angle that the whole object fills, in degrees: sets the distance (default 35)")
        .takes("DEG")
        .group(group);
    command
        .option("--supersampling", o->supersampling,
                "Colour samples per pixel and axis, 1 to 8 (default 4)")
        .range(1, 8)
        .group(group);
    command
        .option("--normals", o->normals,
                "mesh: keep the model's own normals (SimpleTextureV2); or none (default none)")
        .oneOf({"mesh", "none"})
        .group(group);
    command.option("--plot", o->plot, "With auto: draw quality against the number of views")
        .takes("FILE.svg")
        .group(group);
    command.option("--depth-bits", o->depthBits, "8, 16 or 32 (float, .exr only); default 16")
        .oneOf({8, 16, 32})
        .group("Coding");
}

Result<void> checkMeshViewOptions(const MeshViewOptions& o, const Command& command,
                                  Program& program) {
    STX_TRY(const auto automatic, parseAuto(o.views));
    STX_CHECK(framingOf(o, false, program));
    if (!automatic) STX_CHECK(command.refuse({"--plot"}, "is of --views auto:N"));
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
    return fail(ErrorCode::io, "cannot read the camera file '{}' of --views: there is no such file",
                o.views);
}

Result<Bundle> captureMesh(const Mesh& mesh, const MeshViewOptions& o, Program& program,
                           Selection* selection) {
    STX_CHECK(mesh.check());
    CaptureSettings capture;
    capture.supersampling = o.supersampling;
    capture.depthBits = o.depthBits.value_or(16);
    capture.meshNormals = o.normals == "mesh";
    STX_TRY(const auto automatic, parseAuto(o.views));
    std::vector<Camera> cameras;
    if (automatic) {
        STX_TRY(cameras, autoCameras(mesh, *automatic, o, capture, program, selection));
    } else {
        STX_TRY(cameras, layoutOrFile(mesh, o, program));
    }
    STX_TRY(auto bundle, captureBundle(mesh, cameras, capture, program.job));
    noteDepthLoss(bundle, program.job);
    return bundle;
}

void noteDepthLoss(const Bundle& bundle, Job& job) {
    double worst = 0;
    for (const auto& view : bundle.views) {
        if (view.depthBits == 8) worst = std::max(worst, view.depthCode().step() * 0.5);
    }
    if (worst > 0)
        job.note(
            fmt::format("depth in 8 bits is off by up to {:.3g} scene units; --depth-bits 16 is "
                        "257 times finer",
                        worst));
}

}  // namespace stx::tools
