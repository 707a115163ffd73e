#include "formats/imagesets/camera_file.hpp"

#include "formats/files/files.hpp"
#include "formats/files/messages.hpp"
#include "formats/files/named_files.hpp"
#include "formats/imagesets/kinds.hpp"
#include "lib/base/counted.hpp"

namespace stx {
namespace {

/// What can be drawn of the views of a file.
Result<std::vector<NamedCamera>> camerasOf(const std::vector<imagesets::SetView>& views,
                                           const std::string& where, Job& job,
                                           std::optional<glm::ivec2> size) {
    using namespace imagesets;
    if (views.empty())
        return failAt(where, ErrorCode::invalidInput, "it has no camera; at least one is expected");
    std::vector<NamedCamera> out;
    std::optional<glm::ivec2> assumed;
    int lenses = 0;
    for (const SetView& view : views) {
        if (!view.lens.ideal()) ++lenses;
        if (view.panorama)
            return failAt(where, ErrorCode::invalidInput,
                          "camera '{}' is equirectangular; only perspective and orthographic "
                          "cameras can be used here",
                          view.name);
        // Blender's files have an angle only, the size is that of the images. A principal point is
        // near their middle.
        const glm::ivec2 used = size ? *size : view.told.sizeAround().value_or(glm::ivec2(512));
        const Camera camera = view.cameraOf(used);
        if (view.camera.width == 0 && !size) assumed = used;
        if (auto ok = camera.check(); !ok)
            return tl::unexpected(ok.error().at(fmt::format("camera '{}'", view.name)).at(where));
        out.push_back({view.name, camera, view.time, view.refined.moved.has_value()});
    }
    if (assumed)
        job.note(fmt::format("{} does not tell the images' size; {}x{} is used", where, assumed->x,
                             assumed->y));
    if (lenses > 0)
        job.note(fmt::format("{}: pictures are drawn without the lens distortion of {}", where,
                             counted(lenses, "camera")));
    return out;
}

/// The cameras of a camera_path.json, in the world of the images where that is known.
Result<std::vector<imagesets::SetView>> cameraPathInWorld(const imagesets::Json& file,
                                                          const std::filesystem::path& path,
                                                          std::filesystem::path dataparser,
                                                          Job& job) {
    using namespace imagesets;
    STX_TRY(auto views, cameraPathViews(file, job));
    const auto folder = path.parent_path();
    std::error_code ec;
    if (dataparser.empty() &&
        std::filesystem::is_regular_file(folder / "dataparser_transforms.json", ec))
        dataparser = folder / "dataparser_transforms.json";
    if (dataparser.empty()) {
        job.note(
            "a camera_path.json is in the world of nerfstudio's viewer: that of the images only "
            "when they were loaded without orienting, centring and scaling them; with the "
            "dataparser_transforms.json of the training beside it this is undone");
        return views;
    }
    STX_TRY(const Json said, readJson(dataparser, job.limits));
    std::optional<Json> transforms;
    // nerfstudio has its paths in camera_paths/ beside the transforms.json.
    for (const auto& beside : {folder, folder / "..", dataparser.parent_path()}) {
        if (transforms || !std::filesystem::is_regular_file(beside / "transforms.json", ec))
            continue;
        STX_TRY(transforms, readJson(beside / "transforms.json", job.limits));
    }
    if (auto ok = undoDataparser(said, transforms ? &*transforms : nullptr, views, job); !ok)
        return tl::unexpected(ok.error().at(inQuotes(dataparser.string())));
    job.note(fmt::format("the cameras are taken out of nerfstudio's normalised world as {} says{}",
                         inQuotes(dataparser.string()),
                         transforms ? ""
                                    : "; they are right where the set has no applied_transform, as "
                                      "its transforms.json is neither in the folder of the path, "
                                      "nor in the one above, nor beside that file"));
    return views;
}

/// Remembers the pictures that a camera file names (`file_path`, `depth_file_path`, `mask_path` of
/// transforms.json), which are not read here. Names of cameras are none: what was drawn for them
/// may be drawn again.
void rememberPictures(const imagesets::Json& value, const std::filesystem::path& folder) {
    if (value.is_array())
        for (const imagesets::Json& part : value) rememberPictures(part, folder);
    if (!value.is_object()) return;
    for (const auto& [key, part] : value.items()) {
        if (part.is_string() && key.ends_with("_path"))
            rememberNamedFile(folder / imagesets::withImageEnding(folder, part));
        else
            rememberPictures(part, folder);
    }
}

}  // namespace

Result<std::vector<NamedCamera>> readCameraFile(const std::filesystem::path& path, Job& job,
                                                std::optional<glm::ivec2> size,
                                                const std::filesystem::path& dataparser) {
    using namespace imagesets;
    const std::string where = inQuotes(path.string());
    std::error_code ec;
    const auto ending = path.extension();
    if (std::filesystem::is_directory(path, ec) || ending == ".bin" || ending == ".txt") {
        STX_TRY(const auto views, colmapViews(path, job));
        return camerasOf(views, where, job, size);
    }
    STX_TRY(const Json file, readJson(path, job.limits));
    rememberPictures(file, folderOf(path));
    Result<std::vector<SetView>> views =
        fail(ErrorCode::invalidInput,
             "a list 'frames' (transforms.json), 'cameras' (MIV, cameras.json) or 'camera_path' "
             "(nerfstudio) is expected in it; none was found");
    switch (jsonKindOf(file)) {
        case JsonKind::cameraPath:
            views = cameraPathInWorld(file, path, dataparser, job);
            break;
        case JsonKind::transforms:
            views = transformsViews(file, job);
            break;
        case JsonKind::miv:
            views = mivViews(file, job);
            break;
        case JsonKind::cameras:
            views = camerasJsonViews(file, job);
            break;
        case JsonKind::none:
            break;
    }
    if (!views) return tl::unexpected(views.error().at(where));
    return camerasOf(*views, where, job, size);
}

}  // namespace stx
