#include "formats/any/open.hpp"
#include "formats/any/save.hpp"
#include "formats/any/sequences.hpp"
#include "formats/atlas/atlas_files.hpp"
#include "formats/imagesets/image_sets.hpp"
#include "formats/stx/mesh_views.hpp"
#include "lib/geometry/view_layout.hpp"
#include "lib/model/splat_cloud.hpp"
#include "lib/registration/camera_moves.hpp"

namespace stx {
namespace {

Bounds boundsOf(const Atlas& atlas) {
    if (atlas.bounds) return *atlas.bounds;
    Bounds bounds;
    if (!atlas.check()) return bounds;  // one that was moved from has no pages
    for (const auto& r : atlas.rectangles) {
        const auto& view = atlas.views[r.view];
        const auto& depth = atlas.pages[r.page].depth;
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
        STX_TRY(auto atlas, openAtlas(path, options, job));
        return Model(std::move(atlas));
    }
    STX_TRY(auto opened, openRenderable(path, options, job));
    return std::visit([](auto&& model) { return Model(std::forward<decltype(model)>(model)); },
                      std::move(opened));
}

Result<void> save(const Bundle& bundle, const std::filesystem::path& target,
                  const SaveOptions& options, Job& job) {
    return saveBundle(bundle, target, options, job);
}

Result<void> save(const Atlas& atlas, const std::filesystem::path& target,
                  const SaveOptions& options, Job& job) {
    if (target == "-")
        return fail(ErrorCode::usage,
                    "'-' is standard output, which is the program's; a folder or a name that ends "
                    "in .exr is expected (./- is a folder of that name)");
    AtlasSaveOptions save;
    save.jpegQuality = options.jpegQuality;
    save.output.noClobber = options.noClobber;
    return writeAtlas(atlas, target, job, save);
}

Result<void> save(Sequence& frames, const std::filesystem::path& target, const SaveOptions& options,
                  Job& job) {
    return saveSequence(frames, target, options, job);
}

namespace {

/// Settings of meshes that were given for views, which have cameras and sizes already.
void noteUnused(const ConvertSettings& given, Job& job) {
    const ConvertSettings usual;
    std::vector<std::string> unused;
    const auto look = [&](auto ConvertSettings::*setting, const char* name) {
        if (given.*setting != usual.*setting) unused.push_back(name);
    };
    look(&ConvertSettings::views, "views");
    look(&ConvertSettings::names, "names");
    look(&ConvertSettings::width, "width");
    look(&ConvertSettings::height, "height");
    look(&ConvertSettings::orthographic, "orthographic");
    look(&ConvertSettings::fovRad, "fov");
    look(&ConvertSettings::elevationRad, "elevation");
    look(&ConvertSettings::supersampling, "supersampling");
    look(&ConvertSettings::meshNormals, "mesh normals");
    look(&ConvertSettings::materials, "materials");
    look(&ConvertSettings::up, "up");
    if (!given.cameras.empty()) unused.push_back("cameras");
    job.noteUnused(unused, "of meshes", "the model has views already");
}

}  // namespace

Result<Bundle> convert(Model model, const ConvertSettings& settings, Job& job) {
    if (settings.depthBits && *settings.depthBits != 8 && *settings.depthBits != 16 &&
        *settings.depthBits != 32)
        return fail(ErrorCode::usage, "depthBits is {}; 8, 16 or 32 is possible",
                    *settings.depthBits);
    // Wrong of any model, though what is not a mesh has views already.
    STX_TRY(const auto best, parseAutoViews(settings.views));
    if (!best) STX_CHECK(parseViewLayout(settings.views));
    Result<Bundle> bundle = Bundle();
    if (const auto* mesh = std::get_if<Mesh>(&model)) {
        STX_CHECK(mesh->check());
        STX_TRY(const auto views, chooseViews(*mesh, settings, job));
        bundle = captureViews(*mesh, views.cameras, settings, job);
    } else if (const auto* atlas = std::get_if<Atlas>(&model)) {
        noteUnused(settings, job);
        bundle = unpack(*atlas, job);
    } else {
        noteUnused(settings, job);
        bundle = std::move(std::get<Bundle>(model));
        STX_CHECK(bundle->check());
    }
    if (!bundle) return bundle;
    if (!settings.title.empty()) bundle->title = settings.title;
    if (settings.depthBits) {
        setDepthBits(*bundle, *settings.depthBits);
        CodedDepth codes;
        for (const ReferenceView& view : bundle->views) codes.add(view);
        codes.note(job);
    }
    return bundle;
}

glm::dvec3 originOf(const Model& model) {
    return std::visit([](const auto& m) { return m.origin; }, model);
}

glm::dvec3 upOf(const Model& model) {
    if (const auto* mesh = std::get_if<Mesh>(&model))
        return mesh->splats ? glm::normalize(glm::dvec3(mesh->splats->up)) : glm::dvec3(0, 1, 0);
    const auto* atlas = std::get_if<Atlas>(&model);
    std::vector<Camera> cameras;
    for (const auto& view : atlas ? atlas->views : std::get<Bundle>(model).views)
        cameras.push_back(view.camera);
    return upOfCameras(cameras);
}

Camera alignedCamera(const Model& model, const Camera& camera) {
    std::vector<MovedCamera> views;
    const auto add = [&](const auto& seen) {
        for (const auto& view : seen.views)
            if (!view.background) views.push_back(MovedCamera::of(view));
    };
    if (const auto* bundle = std::get_if<Bundle>(&model)) add(*bundle);
    if (const auto* atlas = std::get_if<Atlas>(&model)) add(*atlas);
    return MovesOfNeighbours(std::move(views)).aligned(camera);
}

Bounds boundsOf(const Model& model) {
    if (const auto* mesh = std::get_if<Mesh>(&model)) return mesh->bounds();
    if (const auto* atlas = std::get_if<Atlas>(&model)) return boundsOf(*atlas);
    const auto& bundle = std::get<Bundle>(model);
    return bundle.bounds ? *bundle.bounds : bundle.computeBounds();
}

}  // namespace stx
