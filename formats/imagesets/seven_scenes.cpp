// Microsoft's 7-Scenes: frame-NNNNNN.color.png, .depth.png (16 bits, millimetres; 0 and 65535 are
// missing) and .pose.txt (depth camera to world, y down, z forward). Colour and depth come from the
// two cameras of a Kinect.

#include <cmath>
#include <vector>

#include "formats/files/messages.hpp"
#include "formats/imagesets/kinds.hpp"
#include "formats/imagesets/pictures.hpp"
#include "formats/imagesets/poses.hpp"
#include "formats/imagesets/set_options.hpp"
#include "formats/imagesets/text_lines.hpp"
#include "formats/imagesets/two_cameras.hpp"

namespace stx::imagesets {
namespace {

/// The cameras of the Kinect that took 7-Scenes: the intrinsics that its authors name, and a
/// calibration of where one is beside the other, metres.
constexpr PixelIntrinsics kColour{525, 525, 319.5, 239.5}, kDepth{585, 585, 319.5, 239.5};

KnownDepthCamera kinectDepth(glm::ivec2 size) {
    const PixelIntrinsics k = scaledTo(size, kDepth);
    DepthCamera depth;
    depth.fx = k.x;
    depth.fy = k.y;
    depth.cx = k.z + 0.5;
    depth.cy = k.w + 0.5;
    depth.turn = glm::transpose(glm::dmat3(0.99996518, 0.00267651, -0.00790410,   //
                                           -0.00274093, 0.99996303, -0.00815045,  //
                                           0.00788199, 0.00817183, 0.99993554));
    depth.shift = {-0.02555894, 0.00010110, 0.00203183};
    return {depth, true, true, true};
}

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
    STX_TRY(const auto asked, within(where, givenIntrinsics(options)));
    SetDescription set;
    std::optional<glm::ivec2> size;
    PixelIntrinsics k;
    std::optional<DepthCamera> depth;
    for (const std::string& stem : stems) {
        const std::string poseName = stem + ".pose.txt";
        const std::string place = inQuotes((given / poseName).string());
        auto finite = numbersIn(given / poseName, job.limits, 16);
        std::vector<double> n;
        if (finite) {
            n = *finite;
        } else {
            STX_TRY(n, numbersIn(given / poseName, job.limits, 16, Numbers::any));
        }
        if (n.size() != 16)
            return failAt(place, ErrorCode::invalidInput, "{} numbers; 4 rows of 4 are expected",
                          n.size());
        SetView view;
        view.name = stem;
        STX_CHECK(
            findPictures(given, stem + ".color.png", stem + ".depth.png", where, job.limits, view));
        if (!view.missing && !finite) {
            view.lost = true;
            view.missing = finite.error();
        } else if (!view.missing && rotationOfRows(n) == glm::dmat3(0.0)) {
            view.lost = true;
            view.missing =
                failAt(place, ErrorCode::invalidInput, "the rotation is of zeros").value();
        }
        if (view.lost) view.missing->message += ", as tracking was lost";
        if (view.missing) {
            set.views.push_back(std::move(view));
            continue;
        }
        if (!size) {
            STX_TRY(size, within(where, imageSizeOf(view.texture, job)));
            // Damaged depth is an error where it is read.
            const glm::ivec2 depthSize = imageSizeOf(view.depth, job).value_or(*size);
            // Another colour camera is one of another device, whose depth camera nobody knows.
            const bool own = asked && *asked != scaledTo(*size, kColour);
            k = own ? *asked : scaledTo(*size, kColour);
            KnownDepthCamera known = kinectDepth(depthSize);
            known.byDefault = !own;
            if (own) {
                known.camera.fx = std::copysign(known.camera.fx, k.x);
                known.camera.fy = std::copysign(known.camera.fy, k.y);
            }
            STX_TRY(depth, depthCameraOf(options, known, *size, depthSize, where, job));
            if (own)
                noteOddCentre(k, *size, job);
            else
                k = usualIntrinsics("those known of 7-Scenes' colour camera", kColour, *size, job);
            if (own && !depth && options.depthToColour.empty())
                job.note(fmt::format(
                    "depth is taken to lie on the pixels of its picture, as --intrinsics are of "
                    "another colour camera than 7-Scenes'; --depth-intrinsics {:g},{:g},{:g},{:g} "
                    "is the depth camera of these",
                    known.camera.fx, known.camera.fy, known.camera.cx - 0.5,
                    known.camera.cy - 0.5));
        }
        VisionCamera v;
        v.fx = k.x;
        v.fy = k.y;
        // These sets count from the first pixel's centre.
        v.cx = k.z + 0.5;
        v.cy = k.w + 0.5;
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
        view.distances = sensorsOrFloats(options, kMillimetre);
        view.sensor = true;
        set.views.push_back(std::move(view));
    }
    return set;
}

}  // namespace stx::imagesets
