#include "formats/imagesets/camera_file.hpp"

#include "formats/imagesets/kinds.hpp"
#include "formats/imagesets/messages.hpp"

namespace stx {

Result<std::vector<NamedCamera>> readCameraFile(const std::filesystem::path& path, Job& job,
                                                std::optional<glm::ivec2> size) {
    using namespace imagesets;
    const std::string where = inQuotes(path.string());
    STX_TRY(const Json file, readJson(path, job.limits));
    Result<std::vector<SetView>> views =
        fail(ErrorCode::invalidInput,
             "there is neither a list 'frames' (transforms.json) nor a list "
             "'cameras' (MIV, cameras.json) in it");
    switch (jsonKindOf(file)) {
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
    if (views->empty()) return failAt(where, ErrorCode::invalidInput, "there is no camera in it");
    std::vector<NamedCamera> out;
    bool sizeMissing = false;
    for (const SetView& view : *views) {
        if (view.panorama)
            return failAt(where, ErrorCode::invalidInput,
                          "camera '{}' is equirectangular; only perspective and orthographic "
                          "cameras can be used here",
                          view.name);
        Camera camera = view.camera;
        if (camera.width == 0) {
            // Blender's files have an angle only, the size is that of the images.
            const glm::ivec2 used = size.value_or(glm::ivec2(512));
            camera.width = used.x;
            camera.height = used.y;
            camera.cx = used.x * 0.5;
            camera.cy = used.y * 0.5;
            camera.fx = camera.cx / std::tan(view.angleX * 0.5);
            camera.fy = view.angleY > 0 ? camera.cy / std::tan(view.angleY * 0.5) : camera.fx;
            sizeMissing = true;
        }
        if (auto ok = camera.check(); !ok)
            return tl::unexpected(ok.error().at(fmt::format("camera '{}'", view.name)).at(where));
        out.push_back({view.name, camera});
    }
    if (sizeMissing && !size)
        job.note(fmt::format("{} does not tell the images' size; 512x512 is used", where));
    return out;
}

}  // namespace stx
