// Microsoft's 7-Scenes: frame-NNNNNN.color.png, .depth.png (16 bits, millimetres; 0 and 65535 are
// missing) and .pose.txt (depth camera to world, y down, z forward). Colour and depth come from the
// two cameras of a Kinect.

#include <cmath>

#include "formats/files/messages.hpp"
#include "formats/imagesets/kinds.hpp"
#include "formats/imagesets/pictures.hpp"
#include "formats/imagesets/poses.hpp"
#include "formats/imagesets/set_options.hpp"
#include "formats/imagesets/text_lines.hpp"
#include "formats/imagesets/two_cameras.hpp"

namespace stx::imagesets {
namespace {

/// The depth camera of the Kinect that took 7-Scenes: the intrinsics that its authors name, and a
/// calibration of that Kinect's two cameras, metres.
DepthCamera kinectDepth() {
    DepthCamera depth;
    depth.fx = depth.fy = 585;
    depth.cx = 320;
    depth.cy = 240;
    depth.turn = glm::transpose(glm::dmat3(0.99996518, 0.00267651, -0.00790410,   //
                                           -0.00274093, 0.99996303, -0.00815045,  //
                                           0.00788199, 0.00817183, 0.99993554));
    depth.shift = {-0.02555894, 0.00010110, 0.00203183};
    return depth;
}
/// Of its colour camera, likewise.
constexpr double kColourFocal = 525, kColourX = 320, kColourY = 240;

}  // namespace

Result<SetDescription> describeSevenScenes(const path& given, const ImageSetOptions& options,
                                           Job& job) {
    const std::string where = inQuotes(given.string());
    std::vector<std::string> stems;
    for (const std::string& name : filesIn(given))
        if (name.ends_with(".pose.txt")) stems.push_back(name.substr(0, name.size() - 9));
    if (stems.empty())
        return failAt(
            where, ErrorCode::io,
            "no frame-NNNNNN.pose.txt was found in it; give the folder of one sequence (seq-01)");
    STX_CHECK(
        checkViewCount(stems.size() / static_cast<std::size_t>(options.every), job.limits, where));
    const auto* k = options.intrinsics;
    const bool own = k[0] != 0;
    if (own && k[1] == 0)
        return failAt(where, ErrorCode::usage, "the focal lengths are {:g} and {:g}", k[0], k[1]);
    // Another colour camera is one of another device.
    DepthCamera known = kinectDepth();
    if (own) {
        known.fx = std::copysign(known.fx, k[0]);
        known.fy = std::copysign(known.fy, k[1]);
    }
    STX_TRY(const auto depth, depthCameraOf(options, known, !own, where, job));
    SetDescription set;
    std::optional<glm::ivec2> size;
    for (const std::string& stem : stems) {
        const std::string poseName = stem + ".pose.txt";
        const std::string place = inQuotes((given / poseName).string());
        STX_TRY(const auto n, numbersIn(given / poseName, job.limits, 16));
        if (n.size() != 16)
            return failAt(place, ErrorCode::invalidInput, "{} numbers; 4 rows of 4 are expected",
                          n.size());
        SetView view;
        view.name = stem;
        STX_CHECK(
            findPictures(given, stem + ".color.png", stem + ".depth.png", where, job.limits, view));
        if (view.missing) {
            set.views.push_back(std::move(view));
            continue;
        }
        if (!size) {
            STX_TRY(size, within(where, imageSizeOf(view.texture, job)));
        }
        VisionCamera v;
        v.fx = own ? k[0] : kColourFocal;
        v.fy = own ? k[1] : kColourFocal;
        v.cx = own ? k[2] + 0.5 : kColourX;
        v.cy = own ? k[3] + 0.5 : kColourY;
        v.width = size->x;
        v.height = size->y;
        v.centre = {n[3], n[7], n[11]};
        STX_TRY(v.worldFromCamera, repairRotation(rotationOfRows(n), v.fx, place, job));
        if (depth) {
            // The pose is that of the depth.
            v.worldFromCamera = v.worldFromCamera * glm::transpose(depth->turn);
            v.centre -= v.worldFromCamera * depth->shift;
            view.depthCamera = cameraBeside(v, *depth);
        }
        view.camera = cameraFromVision(v);
        view.distances = scaledIntegers(unitOf(options, kMillimetre), 65535);
        view.sensor = true;
        set.views.push_back(std::move(view));
    }
    if (!own)
        job.note(
            fmt::format("the set does not tell its intrinsics; those known of 7-Scenes' colour "
                        "camera are used (f {:g}, centre {:g}, {:g}); others with --intrinsics",
                        kColourFocal, kColourX, kColourY));
    if (depth)
        job.note(fmt::format(
            "depth comes from a camera of its own (f {:g}, {:.3g} mm beside) and is taken into the "
            "picture of the colour camera; --depth-to-colour none leaves it as it is",
            depth->fx, 1000 * glm::length(depth->shift)));
    return set;
}

}  // namespace stx::imagesets
