#include "formats/imagesets/two_cameras.hpp"

#include "formats/files/messages.hpp"
#include "formats/imagesets/text_lines.hpp"

namespace stx::imagesets {
namespace {

/// Reads the rows of R | t, with or without the last row 0 0 0 1.
Result<void> readMotion(const std::string& file, DepthCamera& depth, Job& job) {
    const std::string where = inQuotes(file);
    STX_TRY(const auto n, numbersIn(file, job.limits, 16));
    if (n.size() != 12 && n.size() != 16)
        return failAt(where, ErrorCode::invalidInput,
                      "{} numbers; 3 or 4 rows of 4 (a rotation and a shift, from the depth camera "
                      "to the colour camera) are expected",
                      n.size() > 16 ? "more than 16" : std::to_string(n.size()));
    if (n.size() == 16 && !(n[12] == 0 && n[13] == 0 && n[14] == 0 && n[15] == 1))
        return failAt(where, ErrorCode::invalidInput,
                      "the last row is {:g} {:g} {:g} {:g}; 0 0 0 1 is expected", n[12], n[13],
                      n[14], n[15]);
    depth.shift = {n[3], n[7], n[11]};
    STX_TRY(depth.turn, repairRotation(rotationOfRows(n), depth.fx, where, job));
    return {};
}

}  // namespace

Result<std::optional<DepthCamera>> depthCameraOf(const ImageSetOptions& options,
                                                 const DepthCamera& known, bool byDefault,
                                                 const std::string& where, Job& job) {
    const auto& k = options.depthIntrinsics;
    if (options.depthToColour == "none" ||
        options.refine.of(RefineStep::reproject) == RefineSwitch::off) {
        if (k)
            return failAt(where, ErrorCode::usage,
                          "--depth-to-colour none says that the depth lies on the pixels of its "
                          "picture, but --depth-intrinsics are given; give one of them");
        return std::nullopt;
    }
    if (options.depthToColour.empty() && !k && !byDefault) return std::nullopt;
    DepthCamera depth = known;
    if (k) {
        if (!(k->x * known.fx > 0 && k->y * known.fy > 0))
            return failAt(where, ErrorCode::usage,
                          "the depth camera's focal lengths are {:g} and {:g}; {} expected, in "
                          "pixels of the depth",
                          k->x, k->y,
                          known.fx > 0 && known.fy > 0
                              ? "two above 0 are"
                              : fmt::format("the signs of the colour camera's ({:g} and {:g}) are",
                                            known.fx, known.fy));
        depth.fx = k->x;
        depth.fy = k->y;
        // These sets count from the first pixel's centre.
        depth.cx = k->z + 0.5;
        depth.cy = k->w + 0.5;
    }
    if (!options.depthToColour.empty()) STX_CHECK(readMotion(options.depthToColour, depth, job));
    return depth;
}

Camera cameraBeside(const VisionCamera& colour, const DepthCamera& depth) {
    VisionCamera v;
    v.worldFromCamera = colour.worldFromCamera * depth.turn;
    v.centre = colour.centre + colour.worldFromCamera * depth.shift;
    v.fx = depth.fx;
    v.fy = depth.fy;
    v.cx = depth.cx;
    v.cy = depth.cy;
    return cameraFromVision(v);
}

}  // namespace stx::imagesets
