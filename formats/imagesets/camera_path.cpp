// camera_path.json: the cameras of a film, as the viewer of nerfstudio writes them. Poses are 16
// numbers, world from camera, row by row, in our own axes; `fov` is vertical, in degrees.

#include <cmath>

#include "formats/imagesets/kinds.hpp"
#include "formats/imagesets/messages.hpp"
#include "formats/imagesets/poses.hpp"

namespace stx::imagesets {

Result<std::vector<SetView>> cameraPathViews(const Json& file, Job& job) {
    STX_TRY(const auto type, findText(file, "camera_type", ""));
    if (type.value_or("perspective") != "perspective")
        return fail(ErrorCode::invalidInput, "'camera_type' is '{}'; only perspective can be drawn",
                    *type);
    STX_TRY(const double width, needNumber(file, "render_width", ""));
    STX_TRY(const double height, needNumber(file, "render_height", ""));
    const Json& cameras = file["camera_path"];
    STX_CHECK(checkViewCount(cameras.size(), job.limits, "'camera_path'"));
    std::vector<SetView> views;
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        const std::string where = fmt::format("camera_path[{}]", i);
        const Json& entry = cameras[i];
        if (!entry.is_object())
            return failAt(where, ErrorCode::invalidInput, "an object is expected");
        SetView view;
        view.name = fmt::format("camera{:04}", i);
        Camera& c = view.camera;
        STX_TRY(c.width, imageSide(width, "render_width", 65535, ""));
        STX_TRY(c.height, imageSide(height, "render_height", 65535, ""));
        STX_TRY(const double fov, needNumber(entry, "fov", where));
        if (!(fov > 0 && fov < 180))
            return failAt(where, ErrorCode::invalidInput,
                          "'fov' is {:g}; it must be above 0 and below 180 degrees", fov);
        c.fx = c.fy = c.height * 0.5 / std::tan(glm::radians(fov) * 0.5);
        c.cx = c.width * 0.5;
        c.cy = c.height * 0.5;
        STX_TRY(const auto m, needNumbers(entry, "camera_to_world", 16, where));
        glm::dmat3 rotation;
        for (int row = 0; row < 3; ++row) {
            for (int column = 0; column < 3; ++column)
                rotation[column][row] = m[static_cast<std::size_t>(4 * row + column)];
            c.position[row] = m[static_cast<std::size_t>(4 * row + 3)];
        }
        STX_TRY(rotation, repairRotation(rotation, c.fy, where, job));
        c.orientation = glm::normalize(glm::quat_cast(rotation));
        if (auto ok = c.check(); !ok) return tl::unexpected(ok.error().at(where));
        views.push_back(std::move(view));
    }
    job.note(
        "a camera_path.json is in the world of nerfstudio's viewer: that of the images only when "
        "they were loaded without orienting, centring and scaling them");
    return views;
}

}  // namespace stx::imagesets
