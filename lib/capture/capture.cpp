#include "lib/capture/capture.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "lib/base/parallel.hpp"
#include "lib/capture/material_sampler.hpp"
#include "lib/model/depth_values.hpp"
#include "lib/model/strays.hpp"

namespace stx {
namespace {

Texture straightTexture(const Image<glm::vec4>& premultiplied) {
    Rgba8Image image(premultiplied.width(), premultiplied.height());
    for (std::size_t i = 0; i < image.count(); ++i) {
        const glm::vec4 c = premultiplied.pixels()[i];
        if (!(c.w > 0.0f)) continue;
        const glm::vec3 straight = glm::clamp(glm::vec3(c) / c.w, 0.0f, 1.0f);
        // Any coverage at all stays above 0, which means background.
        const float alpha = std::max(1.0f, std::round(std::min(c.w, 1.0f) * 255.0f));
        image.pixels()[i] =
            glm::u8vec4(glm::u8vec3(straight * 255.0f + 0.5f), static_cast<std::uint8_t>(alpha));
    }
    Texture texture(std::move(image));
    bleedColour(texture);
    return texture;
}

/// Says what becomes of glass: a view has one depth a pixel.
void noteTranslucent(const Mesh& mesh, Job& job) {
    std::string first;
    int count = 0;
    for (const auto& m : mesh.materials) {
        if (m.alpha != Material::Alpha::blend || !(m.baseColour.a < 1.0f)) continue;
        if (count++ == 0) first = m.name;
    }
    if (count == 0) return;
    job.note(fmt::format(
        "material '{}'{} translucent: a pixel has the depth of the surface that shows most there; "
        "its colour mixes all of them, its alpha says how much they hide",
        first,
        count == 1   ? " is"
        : count == 2 ? " and one more are"
                     : fmt::format(" and {} more are", count - 1)));
}

}  // namespace

void fitDepthRange(ReferenceView& view) {
    const DepthSummary points = summariseDepth(view.depth.pixels());
    if (points.points == 0) return;
    float nearest = points.nearest, farthest = std::max(points.farthest, 0.0f);
    // A flat object facing the camera still needs a range.
    if (nearest == farthest) {
        const float slack = std::max(farthest * 1e-4f, 1e-6f);
        nearest = std::max(0.0f, nearest - slack);
        farthest += slack;
    }
    view.nearPlane = nearest;
    view.farPlane = farthest;
    if (view.depthBits == 32) return;
    roundToCode(view.depth.pixels(), view.depthCode());
}

Result<ReferenceView> captureView(const Mesh& mesh, const Camera& camera, std::string name,
                                  const CaptureSettings& settings, Job& job) {
    RasterSettings raster;
    raster.supersampling = settings.supersampling;
    raster.normals = settings.meshNormals;
    raster.materials = settings.materials;
    STX_TRY(auto image, rasterise(mesh, camera, raster, job));
    ReferenceView view;
    view.name = std::move(name);
    view.camera = camera;
    view.depthBits = settings.depthBits;
    view.texture = straightTexture(image.colour);
    view.depth = std::move(image.depth);
    view.normal = std::move(image.normal);
    view.metallicRoughness = std::move(image.metallicRoughness);
    view.emissive = std::move(image.emissive);
    fitDepthRange(view);
    return view;
}

Result<Bundle> captureBundle(const Mesh& whole, const std::vector<Camera>& cameras,
                             const CaptureSettings& settings, Job& job) {
    STX_CHECK(whole.check());
    // A stray behind the object would take the range of its view's depth codes for itself.
    const auto strays = findStrays(whole);
    std::optional<Mesh> rest;
    if (!strays.pieces.empty()) {
        rest = whole;
        dropStrays(*rest, strays);
    }
    const Mesh& mesh = rest ? *rest : whole;
    noteTranslucent(mesh, job);
    if (!settings.names.empty() && settings.names.size() != cameras.size())
        return fail(ErrorCode::usage, "there are {} names for {} cameras", settings.names.size(),
                    cameras.size());
    std::uint64_t pixels = 0;
    for (const auto& c : cameras) {
        STX_CHECK(c.check());
        pixels += static_cast<std::uint64_t>(c.width) * c.height;
    }
    const bool surface = settings.materials && hasMetallicRoughness(mesh);
    const bool glow = settings.materials && emits(mesh);
    STX_CHECK(job.limits.checkAllocation(
        pixels, 8 + (settings.meshNormals ? 12 : 0) + (surface ? 8 : 0) + (glow ? 12 : 0),
        "the reference views"));
    if (settings.materials && !surface && !glow)
        job.note(
            "the model has neither metallic-roughness nor emissive materials; "
            "--materials has nothing to keep");
    if (glow)
        job.note(
            "what gives off light has it in the emissive images alone, for engines; pictures by "
            "stx render are without it");

    const auto n = static_cast<std::int64_t>(cameras.size());
    std::vector<Result<ReferenceView>> views(n, ReferenceView());
    std::atomic<std::int64_t> done = 0;
    const auto capture = [&](std::int64_t i) {
        const auto at = static_cast<std::size_t>(i);
        const std::string name =
            settings.names.empty() ? fmt::format("view{:03}", i) : settings.names[at];
        views[i] = captureView(mesh, cameras[i], name, settings, job);
        job.progress(++done, n, "capturing views");
    };
    // All threads draw one view of a cloud: several views at a time would need the memory of each.
    if (mesh.splats)
        for (std::int64_t i = 0; i < n; ++i) capture(i);
    else
        parallelFor(0, n, capture);
    Bundle bundle;
    for (std::int64_t i = 0; i < n; ++i) {
        if (!views[i]) return tl::unexpected(views[i].error().at(fmt::format("view {}", i)));
        if (views[i]->pointCount() == 0) {
            job.note(fmt::format("view {} sees nothing of the model and was left out", i));
            continue;
        }
        bundle.views.push_back(std::move(*views[i]));
    }
    const auto tooSmall = [](const Camera& c) { return std::max(c.width, c.height) < 16; };
    if (bundle.views.empty() && std::all_of(cameras.begin(), cameras.end(), tooSmall))
        return fail(ErrorCode::invalidInput,
                    "no pixel of the views meets the model: {}x{} pixels are too few; take 16x16 "
                    "or more",
                    cameras[0].width, cameras[0].height);
    if (bundle.views.empty())
        return fail(
            ErrorCode::invalidInput, "{} the model; check the poses and units",
            n == 1 ? "the camera does not see" : fmt::format("none of the {} cameras sees", n));
    bundle.origin = mesh.origin;
    bundle.bounds = strays.bounds;
    return bundle;
}

std::vector<glm::vec3> drawnPoints(const Mesh& mesh) {
    const auto strays = findStrays(mesh);
    std::size_t next = 0;
    const auto isStray = [&](std::uint64_t piece) {
        if (next == strays.pieces.size() || strays.pieces[next] != piece) return false;
        ++next;
        return true;
    };
    // Each corner once: a dense mesh has six triangles around each.
    std::vector<bool> corner(mesh.positions.size());
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        if (isStray(i)) continue;
        for (int k = 0; k < 3; ++k) corner[mesh.triangles[i][k]] = true;
    }
    std::vector<glm::vec3> points;
    for (std::size_t i = 0; i < corner.size(); ++i)
        if (corner[i]) points.push_back(mesh.positions[i]);
    if (mesh.splats) {
        for (std::size_t i = 0; i < mesh.points.size(); ++i)
            if (!isStray(i)) points.push_back(mesh.positions[mesh.points[i]]);
        return points;
    }
    // Loose points are drawn as discs, which must fit into the frame, too.
    const float radius = pointRadius(mesh);
    for (std::size_t i = 0; i < mesh.points.size(); ++i) {
        if (isStray(mesh.triangles.size() + i)) continue;
        const auto p = mesh.points[i];
        for (int axis = 0; axis < 3; ++axis) {
            glm::vec3 offset(0.0f);
            offset[axis] = radius;
            points.push_back(mesh.positions[p] + offset);
            points.push_back(mesh.positions[p] - offset);
        }
    }
    return points;
}

}  // namespace stx
