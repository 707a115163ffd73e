#include "formats/stx/mesh_views.hpp"

#include <algorithm>

#include "lib/base/counted.hpp"
#include "lib/base/whole_number.hpp"
#include "lib/capture/capture.hpp"
#include "lib/model/splat_cloud.hpp"
#include "lib/quality/capture_quality.hpp"

namespace stx {
namespace {

constexpr int kMostViews = 4096;    // of auto:N
constexpr int kMostAutoViews = 64;  // that auto:DBdB may come to

CaptureSettings captureSettings(const ConvertSettings& s) {
    CaptureSettings capture;
    capture.supersampling = s.supersampling;
    capture.depthBits = s.depthBits.value_or(16);
    capture.meshNormals = s.meshNormals;
    capture.materials = s.materials;
    if (!s.cameras.empty()) capture.names = s.names;
    return capture;
}

Result<ViewFraming> framingOf(const Mesh& mesh, const ConvertSettings& s, bool cube,
                              const Limits& limits) {
    if (s.width < 1 || s.height < 1 || s.width > limits.maxImageSide ||
        s.height > limits.maxImageSide)
        return fail(ErrorCode::usage, "views of {}x{} are asked for; 1 to {} pixels are possible",
                    s.width, s.height, limits.maxImageSide);
    if (!(s.fovRad > 0 && s.fovRad < glm::radians(170.0)))
        return fail(ErrorCode::usage,
                    "the field of view is {:g} degrees; it must be above 0 and below 170",
                    glm::degrees(s.fovRad));
    if (s.up && !(glm::length(scaledToOne(*s.up)) > 0))
        return fail(ErrorCode::usage, "up is 0,0,0; it must point somewhere");
    ViewFraming framing;
    framing.width = s.width;
    framing.height = s.height;
    // The six faces of a cube are orthographic in the standard's own example.
    framing.orthographic = s.orthographic.value_or(cube);
    framing.fovRad = s.fovRad;
    framing.up = s.up ? *s.up : mesh.splats ? glm::dvec3(mesh.splats->up) : framing.up;
    return framing;
}

Result<MeshViews> bestViews(const Mesh& mesh, const AutoViews& wanted, const ConvertSettings& s,
                            Job& job) {
    MeshCandidates candidates;
    STX_TRY(candidates.framing, framingOf(mesh, s, false, job.limits));
    SelectSettings select;
    select.count = wanted.count > 0 ? wanted.count : kMostAutoViews;
    candidates.directions = std::max(candidates.directions, std::min(kMostViews, 2 * select.count));
    STX_TRY(auto chosen, selectMeshViews(mesh, candidates, select, job));
    MeshViews views{std::move(chosen.cameras), wanted, std::move(chosen.selection),
                    candidates.directions, 0.0};
    if (wanted.count > 0) return views;
    const auto most = views.cameras.size();
    STX_TRY(const auto fewest,
            fewestCameras(mesh, views.cameras, captureSettings(s), wanted.decibels, job));
    views.cameras.resize(static_cast<std::size_t>(fewest.count));
    views.psnr = fewest.psnr;
    if (fewest.psnr < wanted.decibels)
        job.note(fmt::format(
            "{:g} dB is not reached by {}, the most that are tried; {} {:.1f} dB", wanted.decibels,
            counted(most, "view"),
            fewest.count == 1 ? "1 view reaches" : fmt::format("{} views reach", fewest.count),
            fewest.psnr));
    return views;
}

}  // namespace

Result<std::optional<AutoViews>> parseAutoViews(std::string_view views) {
    if (!views.starts_with("auto")) return std::optional<AutoViews>();
    const auto complain = [&] {
        return fail(ErrorCode::usage,
                    "the views are '{}'; auto:N for the N best (1 to {}) or auto:DBdB for the "
                    "fewest that reach a quality, as in auto:38dB, is expected",
                    views, kMostViews);
    };
    if (views.size() < 6 || views[4] != ':') return complain();
    std::string_view number = views.substr(5);
    const auto parse = [&]<class T>(T& value) {
        const auto parsed = wholeNumber<T>(number);
        value = parsed.value_or(T{});
        return parsed.has_value();
    };
    AutoViews result;
    if (number.size() > 2 && (number.ends_with("dB") || number.ends_with("db"))) {
        number.remove_suffix(2);
        if (!parse(result.decibels) || !(result.decibels > 0 && result.decibels < 100))
            return complain();
    } else if (!parse(result.count) || result.count < 1 || result.count > kMostViews) {
        return complain();
    }
    return std::optional<AutoViews>(result);
}

Result<MeshViews> chooseViews(const Mesh& mesh, const ConvertSettings& s, Job& job) {
    if (!s.cameras.empty()) return MeshViews{s.cameras, {}, {}, 0, 0.0};
    if (!s.names.empty())
        return fail(ErrorCode::usage, "names are of cameras; {} are given, and no cameras",
                    s.names.size());
    const auto checkElevation = [&](bool ring) -> Result<void> {
        if (ring || s.elevationRad == ConvertSettings().elevationRad) return {};
        return fail(ErrorCode::usage,
                    "elevation is of views on a ring; ring:N, not '{}', is expected", s.views);
    };
    STX_TRY(const auto wanted, parseAutoViews(s.views));
    if (wanted) {
        STX_CHECK(checkElevation(false));
        return bestViews(mesh, *wanted, s, job);
    }
    STX_TRY(auto layout, parseViewLayout(s.views));
    STX_CHECK(checkElevation(layout.kind == ViewLayout::Kind::ring));
    STX_TRY(const auto framing,
            framingOf(mesh, s, layout.kind == ViewLayout::Kind::cube, job.limits));
    layout.elevationRad = s.elevationRad;
    STX_TRY(auto cameras, layoutCameras(layout, framing, drawnPoints(mesh)));
    return MeshViews{std::move(cameras), {}, {}, 0, 0.0};
}

static Result<void> checkSupersampling(const ConvertSettings& s) {
    if (s.supersampling >= 1 && s.supersampling <= 8) return {};
    return fail(ErrorCode::usage, "supersampling is {}; 1 to 8 is possible", s.supersampling);
}

Result<void> withViewsOf(
    const Mesh& mesh, const std::vector<Camera>& cameras, const ConvertSettings& s, Job& job,
    const std::function<Result<void>(std::unique_ptr<ViewTable> table, Job& job)>& use) {
    STX_CHECK(checkSupersampling(s));
    return withCapturedViews(mesh, cameras, captureSettings(s), job, use);
}

Result<Bundle> captureViews(const Mesh& mesh, const std::vector<Camera>& cameras,
                            const ConvertSettings& s, Job& job) {
    STX_CHECK(checkSupersampling(s));
    return captureBundle(mesh, cameras, captureSettings(s), job);
}

bool setDepthBits(Bundle& bundle, int bits) {
    bool changed = false;
    for (auto& view : bundle.views) changed = setDepthBits(view, bits) || changed;
    return changed;
}

bool setDepthBits(ReferenceView& view, int bits) {
    if (view.depthBits == bits) return false;
    view.depthBits = bits;
    fitDepthRange(view);
    return true;
}

void CodedDepth::add(const ViewHeader& view) {
    const std::lock_guard lock(mutex_);
    const double step = view.depthCode().step(), pixels = view.depthStepInPixels();
    if (view.depthBits == 8) {
        step8_ = std::max(step8_, step);
    } else if (pixels > ViewHeader::kFineStep) {
        step16_ = std::max(step16_, step);
        pixels_ = std::max(pixels_, pixels);
    }
}

void CodedDepth::note(Job& job) const {
    if (step8_ > 0)
        job.note(fmt::format(
            "depth in 8 bits is off by up to {:.3g} scene units; 16 bits are 257 times finer",
            step8_ / 2));
    if (step16_ > 0)
        job.note(
            fmt::format("depth in 16 bits is off by up to {:.3g} scene units, {:.2g} times "
                        "the size of the nearest pixels; 32 bits keep it, in OpenEXR",
                        step16_ / 2, pixels_ / 2));
}

}  // namespace stx
