// Our own cameras.json, for everybody whose program writes none of the other formats. See
// README.md here.

#include "formats/files/messages.hpp"
#include "formats/imagesets/kinds.hpp"
#include "formats/imagesets/poses.hpp"
#include "formats/imagesets/set_options.hpp"

namespace stx::imagesets {
namespace {

Result<void> setPose(const Json& c, const std::string& where, Camera& camera) {
    STX_TRY(const auto p, needNumbers(c, "position", 3, where));
    camera.position = {p[0], p[1], p[2]};
    STX_TRY(const auto axisAngle, findNumbers(c, "orientation", 4, where));
    STX_TRY(const auto quaternion, findNumbers(c, "quaternion", 4, where));
    if (quaternion) {
        const auto& q = *quaternion;
        if (auto r = rotationFromQuaternion({q[0], q[1], q[2], q[3]}, where); !r)
            return propagate(r);
        camera.orientation = glm::normalize(glm::dquat(q[3], q[0], q[1], q[2]));
    } else if (axisAngle) {
        const auto& a = *axisAngle;
        if (!(glm::length(glm::dvec3(a[0], a[1], a[2])) > 1e-9) && a[3] != 0)
            return failAt(where, ErrorCode::invalidInput, "the axis of 'orientation' is zero");
        camera.orientation = quatFromAxisAngle({a[0], a[1], a[2], a[3]});
    } else {
        return failAt(where, ErrorCode::invalidInput,
                      "neither 'orientation' (axis x y z, angle) nor 'quaternion' (x y z w) is "
                      "given");
    }
    return {};
}

Result<SetView> viewOf(const Json& c, std::size_t index, const std::string& where) {
    SetView view;
    STX_TRY(const auto name, findText(c, "name", where));
    view.name = name.value_or(fmt::format("view{:03}", index));
    STX_TRY(view.time, findNumber(c, "time", where));
    Camera& camera = view.camera;
    STX_TRY(const double width, needNumber(c, "width", where));
    STX_TRY(const double height, needNumber(c, "height", where));
    STX_TRY(camera.width, imageSide(width, "width", 65535, where));
    STX_TRY(camera.height, imageSide(height, "height", 65535, where));
    camera.cx = camera.width * 0.5;
    camera.cy = camera.height * 0.5;

    STX_TRY(const auto projection, findText(c, "projection", where));
    const std::string kind = projection.value_or("perspective");
    if (kind == "equirectangular")
        view.panorama = Panorama();
    else if (kind == "orthographic")
        camera.orthographic = true;
    else if (kind != "perspective")
        return failAt(where, ErrorCode::invalidInput,
                      "'projection' is '{}'; perspective, orthographic and equirectangular are "
                      "known",
                      kind);
    if (!view.panorama) {
        STX_TRY(const auto fov, findNumbers(c, "fieldOfView", 2, where));
        STX_TRY(const auto fx, findNumber(c, "fx", where));
        STX_TRY(const auto fy, findNumber(c, "fy", where));
        if (fx) {
            camera.fx = *fx;
            camera.fy = fy.value_or(*fx);
        } else if (fov) {
            const glm::dvec2 f((*fov)[0], (*fov)[1]);
            if (!(f.x > 0 && f.y > 0) ||
                (!camera.orthographic && !(f.x < 3.1415926 && f.y < 3.1415926)))
                return failAt(where, ErrorCode::invalidInput,
                              "'fieldOfView' is {:g}, {:g}; angles between 0 and pi, or a window's "
                              "width and height are expected",
                              f.x, f.y);
            const Camera from = Camera::fromFieldOfView({}, {1, 0, 0, 0}, f, camera.orthographic,
                                                        camera.width, camera.height);
            camera.fx = from.fx;
            camera.fy = from.fy;
        } else {
            return failAt(where, ErrorCode::invalidInput,
                          "neither 'fx' nor 'fieldOfView' is given");
        }
        STX_TRY(const auto cx, findNumber(c, "cx", where));
        STX_TRY(const auto cy, findNumber(c, "cy", where));
        camera.cx = cx.value_or(camera.cx);
        camera.cy = cy.value_or(camera.cy);
        const std::pair<const char*, double*> lens[] = {
            {"k1", &view.lens.k1}, {"k2", &view.lens.k2}, {"k3", &view.lens.k3},
            {"p1", &view.lens.p1}, {"p2", &view.lens.p2}, {"skew", &view.lens.skew}};
        for (const auto& [key, to] : lens) {
            STX_TRY(const auto value, findNumber(c, key, where));
            *to = value.value_or(0);
        }
        view.lens.skew /= camera.fx;
    }
    STX_CHECK(setPose(c, where, camera));
    if (auto ok = camera.check(); !ok) return tl::unexpected(ok.error().at(where));
    return view;
}

/// Of integers of which nothing is said.
Result<void> notSaid(Image<float>&, const Camera&, int, Job&) {
    return fail(ErrorCode::invalidInput,
                "the depth is stored as integers; 'depthUnit', or 'nearPlane' and 'farPlane', must "
                "tell what they mean");
}

}  // namespace

Result<std::optional<Distances>> camerasDistances(const Json& c, const ImageSetOptions& options,
                                                  const std::string& where) {
    STX_TRY(auto unit, findNumber(c, "depthUnit", where));
    STX_TRY(const auto nearPlane, findNumber(c, "nearPlane", where));
    STX_TRY(const auto farPlane, findNumber(c, "farPlane", where));
    if (unit && !(*unit > 0))
        return failAt(where, ErrorCode::invalidInput, "'depthUnit' is {:g}; it must be above 0",
                      *unit);
    if (nearPlane.has_value() != farPlane.has_value())
        return failAt(where, ErrorCode::invalidInput, "'nearPlane' and 'farPlane' go together");
    if (nearPlane && unit)
        return failAt(where, ErrorCode::invalidInput,
                      "both 'depthUnit' and 'nearPlane' are given; only one can be the depth's "
                      "code");
    if (nearPlane && !(*nearPlane < *farPlane))
        return failAt(where, ErrorCode::invalidInput,
                      "'nearPlane' {:g} must be below 'farPlane' {:g}", *nearPlane, *farPlane);
    const bool given = options.depthUnit > 0;
    if (nearPlane && given)
        return failAt(where, ErrorCode::usage,
                      "its depth is not in steps of a distance, as 'nearPlane' says; leave out "
                      "--depth-unit");
    if (given) unit = options.depthUnit;
    if (unit) return orFloats(options, scaledIntegers(*unit));
    if (!nearPlane) return std::nullopt;
    const auto planes = [from = *nearPlane, to = *farPlane](Image<float>& values, const Camera&,
                                                            int largest, Job&) -> Result<void> {
        const double last = largest - 1;
        for (float& v : values.pixels())
            v = v == 0 ? 0.0f : static_cast<float>(from + (1 - (v - 1) / last) * (to - from));
        return {};
    };
    return orFloats(options, planes);
}

Result<std::vector<SetView>> camerasJsonViews(const Json& file, Job& job) {
    const Json& cameras = file["cameras"];
    STX_CHECK(checkViewCount(cameras.size(), job.limits, "'cameras'"));
    std::vector<SetView> views;
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        const std::string where = fmt::format("cameras[{}]", i);
        if (!cameras[i].is_object())
            return failAt(where, ErrorCode::invalidInput, "an object is expected");
        STX_TRY(auto view, viewOf(cameras[i], i, where));
        views.push_back(std::move(view));
    }
    return views;
}

Result<SetDescription> describeCamerasJson(const path& given, const ImageSetOptions& options,
                                           Job& job) {
    std::error_code ec;
    const path file = std::filesystem::is_directory(given, ec) ? given / "cameras.json" : given;
    const path folder = folderOf(file);
    const std::string where = inQuotes(file.string());
    STX_TRY(const Json json, readJson(file, job.limits));
    if (jsonKindOf(json) != JsonKind::cameras)
        return failAt(where, ErrorCode::invalidInput,
                      "a list 'cameras' with 'texture' and 'depth' is expected in it, as extract "
                      "writes it; name another kind with --from");
    SetDescription set;
    STX_TRY(set.views, within(where, camerasJsonViews(json, job)));
    STX_TRY(const auto title, within(where, findText(json, "title", "")));
    set.title = title.value_or("");
    for (std::size_t i = 0; i < set.views.size(); ++i) {
        SetView& view = set.views[i];
        const Json& c = json["cameras"][i];
        const std::string place = fmt::format("{}: cameras[{}]", where, i);
        STX_TRY(const std::string texture, needText(c, "texture", place));
        STX_TRY(view.texture, sourceInside(folder, texture, place, job.limits));
        STX_TRY(const std::string depth, needText(c, "depth", place));
        STX_TRY(view.depth, sourceInside(folder, depth, place, job.limits));
        STX_TRY(const auto told, camerasDistances(c, options, place));
        view.distances = told ? *told : orFloats(options, notSaid);
        view.time.reset();  // it is of one moment
    }
    return set;
}

}  // namespace stx::imagesets
