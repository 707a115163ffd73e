#include "tools/camera_options.hpp"

#include <numbers>

#include "formats/imagesets/camera_file.hpp"
#include "formats/stx/stx.hpp"
#include "lib/geometry/sway.hpp"
#include "lib/geometry/view_layout.hpp"

namespace stx::tools {

void noteSplatsUp(glm::dvec3 up, Job& job) {
    if (up == glm::dvec3(0, -1, 0))
        job.note("up is taken to be -Y, as in trained clouds in PLY; --up=Y if it is not");
}
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
/// Pictures of --sway: two seconds of a stream, which has 25 a second.
constexpr int kSwayFrames = 50;

Result<void> checkView(int view, std::size_t views) {
    if (view < static_cast<int>(views)) return {};
    return fail(ErrorCode::usage, "--view is {}, but the input has {} reference views, from 0",
                view, views);
}

int swayCount(const CameraOptions& o) {
    return o.swayFrames > 0 ? o.swayFrames : kSwayFrames;
}

}  // namespace

std::vector<MovedCamera> movedCameras(const std::vector<ReferenceView>& views) {
    std::vector<MovedCamera> moved;
    for (const ReferenceView& view : views)
        if (!view.background) moved.push_back(MovedCamera::of(view));
    return moved;
}

Camera inPicture(const Camera& camera, const std::optional<glm::ivec2>& size) {
    if (!size) return camera;
    const double scale = std::min(static_cast<double>(size->x) / camera.width,
                                  static_cast<double>(size->y) / camera.height);
    Camera c = camera;
    c.width = size->x;
    c.height = size->y;
    c.fx *= scale;
    c.fy *= scale;
    c.cx = c.width * 0.5 + (camera.cx - camera.width * 0.5) * scale;
    c.cy = c.height * 0.5 + (camera.cy - camera.height * 0.5) * scale;
    return c;
}

namespace {

/// A single camera.
void addSingleCamera(Command& c, CameraOptions& o) {
    c.option(
         "--eye", o.eye,
         "Position of the camera in the world, in scene units (write --eye=-1,2,3 for a leading "
         "minus). Where 'stx info' names an origin, it counts in: --eye, --target, --cameras "
         "and point lights are in the coordinates of the model that was converted")
        .takes("X,Y,Z");
    c.option("--target", o.target, "What it looks at (default: the middle of the object)")
        .takes("X,Y,Z");
    c.option("--up", o.up,
             "What is up in the picture, and the axis of an orbit: Z, X,Y,Z or with a minus "
             "--up=-Y (default: what the reference views have, else Y)")
        .takes("AXIS");
    c.option("--fov", o.fovDeg,
             "Vertical field of view in degrees, above 0 and below 180 (default 40)")
        .takes("DEG");
    c.option("--ortho", o.orthoHeight,
             "Orthographic camera with a window of this height, in scene units")
        .takes("HEIGHT");
    c.option("--view", o.view, "The camera of reference view K, from 0").takes("K").notNegative();
}

/// Cameras on a circle, or around a view's own pose.
void addPaths(Command& c, CameraOptions& o) {
    c.option("--orbit", o.orbit, "N cameras on a circle around the object")
        .takes("N")
        .range(1, 1000000);
    c.option("--elevation", o.elevationDeg,
             "Height of the orbit above the horizon in degrees (default 15)")
        .takes("DEG")
        .range(-90.0, 90.0);
    c.option("--radius", o.orbitRadius,
             "Of the orbit, in scene units (default: the object fills the picture)")
        .takes("R")
        .positive();
    c.option("--start", o.startDeg,
             "Where the orbit begins, in degrees from the front, counter-clockwise from above "
             "(default 0)")
        .takes("DEG")
        .range(-360.0, 360.0);
    c.option("--arc", o.arcDeg,
             "How far the orbit goes, in degrees; less than 360: the last camera is at its end "
             "(default 360)")
        .takes("DEG")
        .range(-360.0, 360.0);
    c.option("--sway", o.swayPercent,
             "Cameras on an ellipse around the pose of a reference view (--view K, else the "
             "first), as far to each side as this percentage of the median distance of what it "
             "shows, which stays in its place: the moves that one photograph with depth bears")
        .takes("PERCENT")
        .range(0.001, 100.0);
    c.option("--frames", o.swayFrames,
             "Pictures of --sway, once around (default 50; of a film with --times one for each "
             "of its pictures)")
        .takes("N")
        .range(1, 1000000);
}

}  // namespace

void addCameraOptions(const Command& command, CameraOptions& o) {
    Command c = command.under("Camera");
    addSingleCamera(c, o);
    addPaths(c, o);
    c.option(
         "--cameras", o.cameraFile,
         "Every camera of a file (transforms.json, camera_path.json, MIV JSON, cameras.json) or "
         "of a COLMAP model")
        .reads("FILE");
    c.choice<bool>(
        "--camera-poses", o.aligned, {{"given", false}, {"aligned", true}},
        "What the cameras of the file lie beside: given (the views as their image set had "
        "them; where refining moved the cameras of these, those of the file move as the ones near "
        "them did) or aligned (the views as they are now; default given)");
    c.option("--dataparser", o.dataparser,
             "dataparser_transforms.json of the training that a camera_path.json belongs to "
             "(default: one beside it): its cameras then are in the world of the images")
        .reads("FILE");
    c.option("--size", o.size,
             "Size of the picture (default: that of the camera, else 512x512). Where its shape "
             "is not the camera's, more is seen on the longer side: nothing is squeezed or cut")
        .takes("WxH");
}

Result<std::size_t> namedView(int view, const std::vector<ReferenceView>& views) {
    if (views.empty()) return fail(ErrorCode::invalidInput, "the input has no reference views");
    STX_CHECK(checkView(view, views.size()));
    if (view >= 0) return static_cast<std::size_t>(view);
    const auto first = std::ranges::find(views, false, &ReferenceView::background);
    return first == views.end() ? 0 : static_cast<std::size_t>(first - views.begin());
}

namespace {

/// A single picture from somewhere; an orbit may have a target and an axis.
bool isPose(const CameraOptions& o) {
    return !o.eye.empty() || (o.orbit == 0 && (!o.target.empty() || !o.up.empty()));
}

/// Options that exclude each other, and the ranges of lenses.
Result<void> checkWays(const CameraOptions& o) {
    const int ways = (isPose(o) ? 1 : 0) + (o.swayPercent > 0 || o.view >= 0 ? 1 : 0) +
                     (o.orbit > 0 ? 1 : 0) + (o.cameraFile.empty() ? 0 : 1);
    if (ways > 1)
        return fail(
            ErrorCode::usage,
            "--eye/--target/--up, --view, --sway, --orbit and --cameras exclude each other; give "
            "one (an orbit may have --target and --up, and --sway a --view)");
    if (o.fovDeg && !(*o.fovDeg > 0.0 && *o.fovDeg < 180.0))
        return fail(ErrorCode::usage, "--fov is {:g}; it must be above 0 and below 180 degrees",
                    *o.fovDeg);
    if (o.orthoHeight && !(*o.orthoHeight > 0.0))
        return fail(ErrorCode::usage, "--ortho is {:g}; the window's height must be above 0",
                    *o.orthoHeight);
    if (o.fovDeg && o.orthoHeight)
        return fail(ErrorCode::usage, "--fov and --ortho exclude each other; give one");
    return {};
}

/// The lens of cameras of a pose or an orbit, and what is up in their pictures.
Result<CameraSettings> lensOf(const CameraOptions& o, const CameraContext& context,
                              std::optional<glm::ivec2> size, Program& program) {
    CameraSettings lens;
    if (size) {
        lens.width = size->x;
        lens.height = size->y;
    }
    if (o.fovDeg) lens.fovRad = *o.fovDeg * kDegree;
    lens.orthoHeight = o.orthoHeight.value_or(0);
    if (!o.up.empty()) {
        STX_TRY(lens.up, parseDirection(o.up, "--up"));
    } else if (context.up) {
        lens.up = *context.up;
        noteSplatsUp(lens.up, program.job);
    } else {
        lens.up = upOfCameras(context.views);
        if (lens.up != glm::dvec3(0, 1, 0))
            program.job.note(fmt::format(
                "the reference views stand upright along {}{}, and so does the {}; --up changes "
                "that",
                lens.up.x + lens.up.y + lens.up.z < 0 ? "-" : "+",
                lens.up.x != 0   ? "X"
                : lens.up.y != 0 ? "Y"
                                 : "Z",
                isPose(o) ? "picture" : "orbit"));
    }
    return lens;
}

}  // namespace

Result<std::vector<NovelCamera>> makeCameras(const CameraOptions& o, const CameraContext& context,
                                             Program& program) {
    STX_CHECK(checkWays(o));
    std::optional<glm::ivec2> size;
    if (!o.size.empty()) STX_SET(size, parseSize(o.size, program.job.limits));
    if (context.sway) {
        STX_TRY(const auto swaying, swayCameras(context.sway->camera, context.sway->distance,
                                                o.swayPercent / 100, swayCount(o)));
        std::vector<NovelCamera> out;
        for (const Camera& camera : swaying) out.push_back({inPicture(camera, size)});
        return out;
    }
    if (o.view >= 0) {
        STX_CHECK(checkView(o.view, context.views.size()));
        return std::vector<NovelCamera>{{inPicture(context.views[o.view], size)}};
    }
    if (!o.cameraFile.empty()) {
        STX_TRY(auto cameras, readCameraFile(o.cameraFile, program.job, size, o.dataparser));
        std::vector<NovelCamera> out;
        for (auto& c : cameras) {
            c.camera.position -= context.origin;
            if (!o.aligned && !c.aligned) c.camera = context.moved.aligned(c.camera);
            out.push_back({inPicture(c.camera, size), c.time, c.name});
        }
        return out;
    }

    STX_TRY(const CameraSettings lens, lensOf(o, context, size, program));
    glm::dvec3 target = context.bounds.empty() ? glm::dvec3(0) : context.bounds.centre();
    if (!o.target.empty()) {
        STX_TRY(target, parseVec3(o.target, "--target"));
        target -= context.origin;
    }
    const double radius = context.bounds.radius();
    if (!isPose(o)) {
        STX_TRY(const auto circle,
                orbitCameras(target, radius,
                             {std::max(o.orbit, 1), o.elevationDeg * kDegree, o.startDeg * kDegree,
                              o.arcDeg * kDegree, o.orbitRadius},
                             lens));
        std::vector<NovelCamera> out;
        for (const Camera& camera : circle) out.push_back({camera});
        return out;
    }
    glm::dvec3 eye;
    if (o.eye.empty()) {
        STX_TRY(const auto front, orbitCameras(target, radius, 1, 0.0, lens));
        eye = front[0].position;
    } else {
        STX_TRY(eye, parseVec3(o.eye, "--eye"));
        eye -= context.origin;
    }
    STX_TRY(const auto camera, cameraAt(eye, target, lens));
    return std::vector<NovelCamera>{{camera}};
}

Result<int> checkCameraOptions(const CameraOptions& options, const Command& command,
                               Program& program) {
    CameraOptions o = options;
    const bool sways = o.swayPercent > 0;
    const bool own = o.view >= 0 || sways || !o.cameraFile.empty();
    if (own)
        STX_CHECK(command.refuse({"--fov", "--ortho"},
                                 fmt::format("does not go with {}, whose cameras have their own",
                                             sways         ? "--sway"
                                             : o.view >= 0 ? "--view"
                                                           : "--cameras")));
    if (own || isPose(o)) STX_CHECK(command.refuse({"--elevation"}, "is of --orbit"));
    if (o.orbit == 0) STX_CHECK(command.refuse({"--radius", "--start", "--arc"}, "is of --orbit"));
    if (o.cameraFile.empty()) {
        STX_CHECK(command.refuse({"--dataparser"}, "is of --cameras camera_path.json"));
        STX_CHECK(command.refuse({"--camera-poses"}, "is of --cameras"));
    }
    if (!sways) STX_CHECK(command.refuse({"--frames"}, "is of --sway"));
    o.view = -1;  // needs the input
    CameraContext unitCube;
    if (sways) {
        unitCube.sway.emplace();
        unitCube.sway->distance = 1;
    }
    unitCube.bounds.add(glm::dvec3(-1));
    unitCube.bounds.add(glm::dvec3(1));
    Program quiet;  // the same notes come again, when the cameras are made
    quiet.job.limits = program.job.limits;
    STX_TRY(const auto cameras, makeCameras(o, unitCube, quiet));
    return static_cast<int>(cameras.size());
}

}  // namespace stx::tools
