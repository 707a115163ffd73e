#include "formats/mpeg4/mapping/view_images.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "formats/images/images.hpp"
#include "formats/mpeg4/mapping/texture_images.hpp"
#include "formats/mpeg4/mapping/view_notes.hpp"
#include "lib/model/splat_steps.hpp"

namespace stx::mpeg4 {
namespace {

/// By how much floats may be off, as a share of a distance: it is not worth a word.
constexpr double kFloatsOff = 1e-6;

/// The nearest float that is not above (below) a value: planes must keep what lies between them.
float floatBelow(double v) {
    const float f = static_cast<float>(v);
    return static_cast<double>(f) > v ? std::nextafter(f, -std::numeric_limits<float>::infinity())
                                      : f;
}
float floatAbove(double v) {
    const float f = static_cast<float>(v);
    return static_cast<double>(f) < v ? std::nextafter(f, std::numeric_limits<float>::infinity())
                                      : f;
}

/// That of pictures of these bits, 8 or 16, by the planes that are written.
DepthCode writtenCodeOf(const ViewImages& images, int bits) {
    return {images.nearPlane, images.farPlane, bits == 8 ? 255u : 65535u};
}

}  // namespace

bool isFieldOfView(glm::vec2 fov, bool orthographic) {
    constexpr float kPi = 3.14159265f;
    return fov.x > 0 && fov.y > 0 && std::isfinite(fov.x) && std::isfinite(fov.y) &&
           (orthographic || (fov.x < kPi && fov.y < kPi));
}

std::string_view fieldOfViewRule(bool orthographic) {
    return orthographic ? "the window of an orthographic DepthImage has sides above 0"
                        : "angles lie between 0 and 3.1415927 (both excluded)";
}

Result<void> setCamera(Node& node, const Camera& camera) {
    const glm::dvec4 turn = axisAngleFromQuat(camera.orientation);
    const glm::vec3 position(camera.position);
    if (!std::isfinite(position.x) || !std::isfinite(position.y) || !std::isfinite(position.z))
        return fail(ErrorCode::unsupported,
                    "the camera's position ({:g} {:g} {:g}) does not fit 32-bit floats; write .exr",
                    camera.position.x, camera.position.y, camera.position.z);
    const glm::vec2 fov(camera.fieldOfView());
    if (!isFieldOfView(fov, camera.orthographic))
        return fail(ErrorCode::unsupported,
                    "the camera's fieldOfView would be {} {} in 32-bit floats; {}; write .exr",
                    fov.x, fov.y, fieldOfViewRule(camera.orthographic));
    node.set("position", position);
    node.set("orientation", Rotation{glm::vec3(turn), static_cast<float>(turn.w)});
    node.set("fieldOfView", fov);
    return {};
}

bool isWrittenAsV2(const ReferenceView& view, const SceneWriteOptions& options) {
    if (options.nodes == SceneWriteOptions::Nodes::automatic)
        return view.hasNormals() || view.hasSplats();
    return options.nodes == SceneWriteOptions::Nodes::v2;
}

int writtenDepthBits(const ViewHeader& view, const SceneWriteOptions& options) {
    if (options.depthBits != 0) return options.depthBits;
    return view.depthBits == 8 ? 8 : 16;
}

float longestSplatOf(const ReferenceView& view) {
    const float longest = std::max(largestComponent(view.splatU), largestComponent(view.splatV));
    return longest > 0 ? longest : 1.0f;
}

bool isBeyondPlanes(double worstDepth, const DepthCode& code) {
    return worstDepth > 0.5 * code.step() + kFloatsOff * code.farPlane;
}

void DepthLoss::add(const ViewHeader& view, int bits, double worstDepth, double ownStep) {
    // Of depth that is on the codes already.
    const double floats = kFloatsOff * view.farPlane;
    const double rounding = std::max(0.01 * view.depthCode().step(), floats);
    if (view.depthBits != 32 && bits >= view.depthBits && !(bits == 8 && worstDepth > rounding) &&
        worstDepth <= 0.5 * ownStep + floats)
        return;
    worst_ = std::max(worst_, worstDepth);
    bits_ = bits_ == 0 ? bits : std::min(bits_, bits);
}

void DepthLoss::add(const DepthLoss& other) {
    if (other.bits_ == 0) return;
    worst_ = std::max(worst_, other.worst_);
    bits_ = bits_ == 0 ? other.bits_ : std::min(bits_, other.bits_);
}

void DepthLoss::note(Job& job) const {
    if (worst_ > 0)
        job.note(fmt::format("depth is rounded to {} bits: at most {:.4g} scene units off", bits_,
                             worst_));
}

void PictureLoss::add(std::size_t i, const ViewHeader& view, int bits, const ViewImages& images) {
    const double step = i < ownSteps.size() ? ownSteps[i] : view.depthCode().step();
    if (depth.size() <= i) depth.resize(i + 1);
    double worst = images.worstDepth;
    if (images.depthClamped) {
        worstClamped = std::max(worstClamped, worst);
        // How far off the rest is was not looked at.
        worst = 0.5 * writtenCodeOf(images, bits).step();
    }
    depth[i].add(view, bits, worst, step);
    linear = linear || images.linear;
    clamped = clamped || images.clamped;
    coverage = coverage || images.coverageLost;
    splats = splats || images.splatsCoarse;
}

void PictureLoss::note(const SceneWriteOptions& options, Job& job) const {
    DepthLoss ofAll;
    for (const DepthLoss& ofView : depth) ofAll.add(ofView);
    ofAll.note(job);
    if (worstClamped > 0)
        job.note(
            fmt::format("depth beyond nearPlane or farPlane was clamped to them: at most "
                        "{:.4g} scene units off",
                        worstClamped));
    Rgba8Loss{.linear = linear, .clipped = clamped}.note(job);
    if (options.texture == SceneWriteOptions::Texture::jpeg && !options.pointTexture)
        job.note(fmt::format("colour is JPEG of quality {}, which is lossy", options.jpegQuality));
    if (coverage)
        job.note(fmt::format("{} has no alpha: soft edges of the coverage are lost",
                             options.pointTexture ? "a PointTexture" : "JPEG"));
    if (splats)
        job.note(
            fmt::format("splat axes of a view are coded in steps of more than {:g} % of their "
                        "median: its codes reach to the longest axis; .exr keeps them exactly",
                        100 * SplatSteps::kMostStep));
}

Result<ViewImages> encodeView(const ReferenceView& view, const SceneWriteOptions& options,
                              const Limits& limits, float longestSplat) {
    ViewImages out;
    STX_TRY(out.padding, centringPadding(view.camera, std::min(limits.maxImageSide, 65535)));
    out.nearPlane = floatBelow(view.nearPlane);
    out.farPlane = floatAbove(view.farPlane);
    if (!std::isfinite(out.farPlane) || !(out.nearPlane < out.farPlane))
        return fail(ErrorCode::unsupported,
                    "nearPlane {:g} and farPlane {:g} do not fit 32-bit floats", view.nearPlane,
                    view.farPlane);
    const DepthCode code = writtenCodeOf(out, writtenDepthBits(view, options));
    const bool mayBeUnknown = view.depthMayBeUnknown();
    STX_CHECK(view.texture.check());
    out.linear = view.texture.isLinear();
    if (options.pointTexture) {
        for (const float d : view.depth.pixels()) {
            if (!(d >= 0)) return depthError(d);
            if (hasPoint(d))
                out.worstDepth =
                    std::max(out.worstDepth, std::abs(code.decode(code.encode(d)) - d));
        }
        out.depthClamped = isBeyondPlanes(out.worstDepth, code);
        const Rgba8Image colour = rgba8FromTexture(view.texture, out.clamped);
        out.coverageLost = !alphaFollowsDepth(colour, view.depth, mayBeUnknown);
        if (mayBeUnknown) STX_SET(out.unknown, unknownMask(colour, view.depth));
        // Other views show what was pruned.
        if (view.noDepth == NoDepth::unknown && !view.pruned)
            for (std::size_t i = 0; i < colour.count() && !out.unmeasuredLost; ++i)
                out.unmeasuredLost = !hasPoint(view.depth.data()[i]) && colour.data()[i].a == 255;
        return out;
    }
    STX_TRY(out.depth, depthPng(view.depth, code, out.padding, out.worstDepth));
    out.depthClamped = isBeyondPlanes(out.worstDepth, code);
    // Copies of large pictures would be half of the memory of writing.
    const Rgba8Image* own = view.texture.rgba8();
    Rgba8Image coded;
    if (!own) coded = rgba8FromTexture(view.texture, out.clamped);
    const Rgba8Image& colour = own ? *own : coded;
    const bool alpha = !alphaFollowsDepth(colour, view.depth);
    if (mayBeUnknown) out.unknown = kUnknownInAlpha;
    if (options.texture == SceneWriteOptions::Texture::jpeg) {
        out.coverageLost = !alphaFollowsDepth(colour, view.depth, mayBeUnknown);
        if (mayBeUnknown) STX_SET(out.unknown, unknownMask(colour, view.depth));
        STX_TRY(out.texture, colourJpeg(colour, options.jpegQuality, out.padding));
    } else {
        STX_TRY(out.texture, colourPng(colour, alpha, out.padding));
    }
    if (!isWrittenAsV2(view, options)) return out;
    if (view.hasNormals())
        STX_SET(out.normal, normalPng(view.normal, options.normalBits, out.padding));
    if (view.hasSplats()) {
        out.longestSplat = longestSplat > 0 ? longestSplat : longestSplatOf(view);
        STX_TRY(out.splatU,
                splatPng(view.splatU, out.longestSplat, options.normalBits, out.padding));
        STX_TRY(out.splatV,
                splatPng(view.splatV, out.longestSplat, options.normalBits, out.padding));
        const double codes = options.normalBits == 8 ? 255 : 65535;
        SplatSteps steps(2 * out.longestSplat / codes);
        for (const auto* axes : {&view.splatU, &view.splatV})
            for (const glm::vec3 axis : axes->pixels()) steps.add(axis);
        out.splatsCoarse = steps.tooCoarse();
    }
    return out;
}

}  // namespace stx::mpeg4
