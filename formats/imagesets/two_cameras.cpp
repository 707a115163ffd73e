#include "formats/imagesets/two_cameras.hpp"

#include <cmath>

#include "formats/files/messages.hpp"
#include "formats/imagesets/pictures.hpp"
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

/// Errors (usage) for intrinsics that no camera has: floats of what they make overflow.
Result<void> checkGiven(const char* option, const PixelIntrinsics& k) {
    constexpr double kLeastFocal = 0.01, kMostPixels = 1e7;  // pixels; telescopes have some 1e6
    const auto fits = [&](double f) {
        return std::abs(f) >= kLeastFocal && std::abs(f) <= kMostPixels;
    };
    if (fits(k.x) && fits(k.y) && std::abs(k.z) <= kMostPixels && std::abs(k.w) <= kMostPixels)
        return {};
    return fail(ErrorCode::usage,
                "{} is {:g},{:g},{:g},{:g}; focal lengths of {:g} to {:g} pixels and a principal "
                "point within {:g} of 0 are expected",
                option, k.x, k.y, k.z, k.w, kLeastFocal, kMostPixels, kMostPixels);
}

}  // namespace

PixelIntrinsics scaledTo(glm::ivec2 size, PixelIntrinsics k, glm::ivec2 of) {
    if (!sameShape(size, of)) return k;
    const double scale = static_cast<double>(size.x) / of.x;
    const PixelIntrinsics corner(0, 0, 0.5, 0.5);
    return (k + corner) * scale - corner;
}

PixelIntrinsics usualIntrinsics(std::string_view from, PixelIntrinsics ofKinect, glm::ivec2 size,
                                Job& job) {
    const PixelIntrinsics k = scaledTo(size, ofKinect);
    std::string fit;
    if (size != kKinectSize)
        fit = sameShape(size, kKinectSize)
                  ? fmt::format(", scaled from 640x480 to {}x{}", size.x, size.y)
                  : fmt::format(", which are of 640x480 and cannot fit {}x{}", size.x, size.y);
    job.note(
        fmt::format("the set does not tell its intrinsics; {} are used (fx {:g}, fy {:g}, cx "
                    "{:g}, cy {:g}{}); others with --intrinsics",
                    from, k.x, k.y, k.z, k.w, fit));
    return k;
}

Result<std::optional<PixelIntrinsics>> givenIntrinsics(const ImageSetOptions& options) {
    const auto& k = options.intrinsics;
    if (k[0] == 0) return std::nullopt;
    if (k[1] == 0)
        return fail(ErrorCode::usage, "the focal lengths of --intrinsics are {:g} and {:g}", k[0],
                    k[1]);
    const PixelIntrinsics given(k[0], k[1], k[2], k[3]);
    STX_CHECK(checkGiven("--intrinsics", given));
    return given;
}

void noteOddCentre(const PixelIntrinsics& k, glm::ivec2 size, Job& job) {
    const glm::dvec2 at(k.z + 0.5, k.w + 0.5);
    if (at.x >= 0 && at.y >= 0 && at.x <= size.x && at.y <= size.y) return;
    job.note(
        fmt::format("the principal point ({:g}, {:g}) of --intrinsics is outside the picture of "
                    "{}x{}",
                    k.z, k.w, size.x, size.y));
}

Result<std::optional<DepthCamera>> depthCameraOf(const ImageSetOptions& options,
                                                 const KnownDepthCamera& known,
                                                 glm::ivec2 colourSize, glm::ivec2 depthSize,
                                                 const std::string& where, Job& job) {
    const auto& k = options.depthIntrinsics;
    const bool none = options.depthToColour == "none";
    if (none || options.refine.of(RefineStep::reproject) == RefineSwitch::off) {
        if (k)
            return failAt(where, ErrorCode::usage,
                          "{} says that the depth lies on the pixels of its picture, but "
                          "--depth-intrinsics are given; give one of them",
                          none ? "--depth-to-colour none" : "--refine without reproject");
        return std::nullopt;
    }
    const bool pose = !options.depthToColour.empty();
    if (!pose && !k && !known.byDefault) return std::nullopt;
    DepthCamera depth = known.camera;
    if (k) {
        if (!(k->x * depth.fx > 0 && k->y * depth.fy > 0))
            return failAt(where, ErrorCode::usage,
                          "the depth camera's focal lengths are {:g} and {:g}; {} expected, in "
                          "pixels of the depth",
                          k->x, k->y,
                          depth.fx > 0 && depth.fy > 0
                              ? "two above 0 are"
                              : fmt::format("the signs of the colour camera's ({:g} and {:g}) are",
                                            depth.fx, depth.fy));
        STX_CHECK(within(where, checkGiven("--depth-intrinsics", *k)));
        depth.fx = k->x;
        depth.fy = k->y;
        // These sets count from the first pixel's centre.
        depth.cx = k->z + 0.5;
        depth.cy = k->w + 0.5;
    } else if (!known.intrinsics) {
        // They are in pixels of the depth.
        if (depthSize != colourSize)
            return failAt(where, ErrorCode::usage,
                          "--depth-to-colour says where the depth camera is, but not what it sees: "
                          "its pictures are {}x{}, and those of the colour camera {}x{}; give "
                          "--depth-intrinsics, too",
                          depthSize.x, depthSize.y, colourSize.x, colourSize.y);
        job.note(
            "the depth camera's intrinsics are taken to be the colour camera's; others with "
            "--depth-intrinsics");
    }
    if (pose)
        STX_CHECK(readMotion(options.depthToColour, depth, job));
    else if (!known.pose)
        job.note(
            "the depth camera is taken to be at the colour camera's place; another with "
            "--depth-to-colour");
    job.note(fmt::format(
        "depth comes from a camera of its own (f {:g}, {:.3g} mm beside) and is taken into the "
        "picture of the colour camera; --depth-to-colour none leaves it as it is",
        std::abs(depth.fx), 1000 * glm::length(depth.shift)));
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
