// camera_path.json: the cameras of a film, as the viewer of nerfstudio writes them. Poses are 16
// numbers, world from camera, row by row, in our own axes; `fov` is vertical, in degrees.

#include <cmath>

#include "formats/files/messages.hpp"
#include "formats/imagesets/kinds.hpp"
#include "formats/imagesets/poses.hpp"

namespace stx::imagesets {
namespace {

/// p -> rotation * p + shift
struct RigidMotion {
    glm::dmat3 rotation{1.0};
    glm::dvec3 shift{0.0};

    void undo(Camera& c) const {
        c.position = glm::transpose(rotation) * (c.position - shift);
        c.orientation = glm::normalize(glm::quat_cast(glm::transpose(rotation)) * c.orientation);
    }
    void apply(Camera& c) const {
        c.position = rotation * c.position + shift;
        c.orientation = glm::normalize(glm::quat_cast(rotation) * c.orientation);
    }
};

Result<RigidMotion> rigidMotionOf(const Json& file, const char* key, const std::string& where,
                                  Job& job) {
    STX_TRY(const glm::dmat4 matrix, needMatrix(file, key, where));
    RigidMotion out;
    out.shift = glm::dvec3(matrix[3]);
    // It turns poses, not pixels: notes give corrections in pixels of a focal length of 1000.
    STX_TRY(out.rotation,
            repairRotation(glm::dmat3(matrix), 1000.0, fmt::format("{}: '{}'", where, key), job));
    return out;
}

/// 1 where there is none.
Result<double> scaleOf(const Json& file, const char* key, const std::string& where) {
    STX_TRY(const auto scale, findNumber(file, key, where));
    if (scale && !(*scale > 0))
        return failAt(where, ErrorCode::invalidInput, "'{}' is {:g}; it must be above 0", key,
                      *scale);
    return scale.value_or(1.0);
}

}  // namespace

Result<void> undoDataparser(const Json& dataparser, const Json* transforms,
                            std::vector<SetView>& views, Job& job) {
    if (!dataparser.is_object())
        return fail(ErrorCode::invalidInput, "'transform' and 'scale' are expected in it");
    STX_TRY(const RigidMotion normalised, rigidMotionOf(dataparser, "transform", "", job));
    STX_TRY(double scale, scaleOf(dataparser, "scale", ""));
    // nerfstudio trains with poses of the transforms.json, oriented, centred and scaled. What was
    // applied before is in the matrix and in the scale that it writes, but not in those poses.
    RigidMotion applied;
    if (transforms != nullptr && transforms->is_object()) {
        if (transforms->contains("applied_transform")) {
            STX_TRY(applied,
                    rigidMotionOf(*transforms, "applied_transform", "transforms.json", job));
        }
        STX_TRY(const double appliedScale,
                scaleOf(*transforms, "applied_scale", "transforms.json"));
        scale /= appliedScale;
    }
    for (SetView& view : views) {
        view.camera.position /= scale;
        normalised.undo(view.camera);
        applied.apply(view.camera);
        if (auto ok = view.camera.check(); !ok)
            return tl::unexpected(ok.error().at(fmt::format("camera '{}'", view.name)));
    }
    return {};
}

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
        c.position = {m[3], m[7], m[11]};
        STX_TRY(const auto rotation, repairRotation(rotationOfRows(m), c.fy, where, job));
        c.orientation = glm::normalize(glm::quat_cast(rotation));
        if (auto ok = c.check(); !ok) return tl::unexpected(ok.error().at(where));
        views.push_back(std::move(view));
    }
    return views;
}

}  // namespace stx::imagesets
