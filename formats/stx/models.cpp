#include <algorithm>
#include <charconv>

#include "formats/atlas/atlas_files.hpp"
#include "formats/imagesets/image_sets.hpp"
#include "formats/open.hpp"
#include "formats/save.hpp"
#include "formats/stx/stx.hpp"
#include "lib/capture/capture.hpp"
#include "lib/capture/rasterizer.hpp"
#include "lib/selection/selection.hpp"

namespace stx {
namespace {

/// N of `auto:N`; nothing for other views. Errors (usage) when N is not a number from 1 to 4096.
Result<std::optional<int>> countOfBest(std::string_view views) {
    constexpr std::string_view kPrefix = "auto:";
    if (!views.starts_with(kPrefix)) return std::optional<int>();
    const auto number = views.substr(kPrefix.size());
    int count = 0;
    const auto parsed = std::from_chars(number.data(), number.data() + number.size(), count);
    if (parsed.ec != std::errc() || parsed.ptr != number.data() + number.size() || count < 1 ||
        count > 4096)
        return fail(ErrorCode::usage, "views are '{}'; auto:N with N from 1 to 4096 is expected",
                    views);
    return std::optional<int>(count);
}

Result<ViewFraming> framingOf(const ConvertSettings& s, bool cube, const Limits& limits) {
    if (s.width < 1 || s.height < 1 || s.width > limits.maxImageSide ||
        s.height > limits.maxImageSide)
        return fail(ErrorCode::usage, "views of {}x{} are asked for; 1 to {} pixels are possible",
                    s.width, s.height, limits.maxImageSide);
    if (!(s.fovRad > 0 && s.fovRad < glm::radians(170.0)))
        return fail(ErrorCode::usage,
                    "fovRad is {:g}; it must be above 0 and below 170 degrees in radians",
                    s.fovRad);
    ViewFraming framing;
    framing.width = s.width;
    framing.height = s.height;
    framing.orthographic = s.orthographic.value_or(cube);
    framing.fovRad = s.fovRad;
    if (!(glm::length(s.up) > 0))
        return fail(ErrorCode::usage, "up is 0,0,0; it must point somewhere");
    framing.up = s.up;
    return framing;
}

Result<std::vector<Camera>> camerasAround(const Mesh& mesh, const ConvertSettings& s, Job& job) {
    if (!s.cameras.empty()) return s.cameras;
    STX_TRY(const auto best, countOfBest(s.views));
    if (best) {
        MeshCandidates candidates;
        STX_TRY(candidates.framing, framingOf(s, false, job.limits));
        candidates.directions = std::max(candidates.directions, std::min(4096, 2 * *best));
        SelectSettings select;
        select.count = *best;
        STX_TRY(auto chosen, selectMeshViews(mesh, candidates, select, job));
        return std::move(chosen.cameras);
    }
    STX_TRY(auto layout, parseViewLayout(s.views));
    STX_TRY(const auto framing, framingOf(s, layout.kind == ViewLayout::Kind::cube, job.limits));
    layout.elevationRad = s.elevationRad;
    return layoutCameras(layout, framing, drawnPoints(mesh));
}

Result<Bundle> captured(const Mesh& mesh, const ConvertSettings& s, Job& job) {
    STX_CHECK(mesh.check());
    if (s.supersampling < 1 || s.supersampling > 8)
        return fail(ErrorCode::usage, "supersampling is {}; 1 to 8 is possible", s.supersampling);
    STX_TRY(const auto cameras, camerasAround(mesh, s, job));
    CaptureSettings capture;
    capture.supersampling = s.supersampling;
    capture.depthBits = s.depthBits.value_or(16);
    capture.meshNormals = s.meshNormals;
    return captureBundle(mesh, cameras, capture, job);
}

void noteDepthLoss(const Bundle& bundle, Job& job) {
    double worst = 0;
    for (const auto& view : bundle.views) {
        if (view.depthBits == 8) worst = std::max(worst, view.depthCode().step() * 0.5);
    }
    if (worst > 0)
        job.note(fmt::format(
            "depth in 8 bits is off by up to {:.3g} scene units; 16 bits are 257 times finer",
            worst));
}

Bounds boundsOf(const Atlas& atlas) {
    if (atlas.bounds) return *atlas.bounds;
    Bounds bounds;
    for (const auto& r : atlas.rectangles) {
        const auto& view = atlas.views[static_cast<std::size_t>(r.view)];
        const auto& depth = atlas.pages[static_cast<std::size_t>(r.page)].depth;
        for (int y = r.viewY; y < r.viewY + r.height; ++y) {
            for (int x = r.viewX; x < r.viewX + r.width; ++x) {
                const auto at = r.atlasFromView(x, y);
                const float dist = depth.at(at.x, at.y);
                if (!hasPoint(dist)) continue;
                bounds.add(view.camera.position +
                           view.camera.orientation * view.camera.unproject(x + 0.5, y + 0.5, dist));
            }
        }
    }
    return bounds;
}

}  // namespace

const char* version() {
    return STX_VERSION;
}

Result<Model> open(const std::filesystem::path& path, const OpenOptions& options, Job& job) {
    STX_TRY(const auto kind, recognise(path));
    if (kind == FileKind::atlas && options.set.from.empty()) {
        STX_TRY(auto atlas, readAtlas(path, job));
        return Model(std::move(atlas));
    }
    STX_TRY(auto opened, openRenderable(path, options, job));
    return std::visit([](auto&& model) { return Model(std::move(model)); }, std::move(opened));
}

Result<void> save(const Bundle& bundle, const std::filesystem::path& target,
                  const SaveOptions& options, Job& job) {
    return saveBundle(bundle, target, options, job);
}

Result<void> save(const Atlas& atlas, const std::filesystem::path& target,
                  const SaveOptions& options, Job& job) {
    AtlasSaveOptions save;
    save.jpegQuality = options.jpegQuality;
    save.output.noClobber = options.noClobber;
    return writeAtlas(atlas, target, job, save);
}

Result<Bundle> convert(Model model, const ConvertSettings& settings, Job& job) {
    if (settings.depthBits && *settings.depthBits != 8 && *settings.depthBits != 16 &&
        *settings.depthBits != 32)
        return fail(ErrorCode::usage, "depthBits is {}; 8, 16 or 32 is possible",
                    *settings.depthBits);
    Result<Bundle> bundle = Bundle();
    if (const auto* mesh = std::get_if<Mesh>(&model)) {
        bundle = captured(*mesh, settings, job);
    } else if (const auto* atlas = std::get_if<Atlas>(&model)) {
        bundle = unpack(*atlas, job);
    } else {
        bundle = std::move(std::get<Bundle>(model));
    }
    if (!bundle) return bundle;
    if (!settings.title.empty()) bundle->title = settings.title;
    if (settings.depthBits) {
        for (auto& view : bundle->views) {
            if (view.depthBits == *settings.depthBits) continue;
            view.depthBits = *settings.depthBits;
            fitDepthRange(view);
        }
        noteDepthLoss(*bundle, job);
    }
    return bundle;
}

glm::dvec3 originOf(const Model& model) {
    return std::visit([](const auto& m) { return m.origin; }, model);
}

Bounds boundsOf(const Model& model) {
    if (const auto* mesh = std::get_if<Mesh>(&model)) return mesh->bounds();
    if (const auto* atlas = std::get_if<Atlas>(&model)) return boundsOf(*atlas);
    const auto& bundle = std::get<Bundle>(model);
    return bundle.bounds ? *bundle.bounds : bundle.computeBounds();
}

}  // namespace stx
