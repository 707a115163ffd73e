#include "formats/imagesets/camera_file.hpp"

#include <cmath>

#include <nlohmann/json.hpp>

#include "formats/files/files.hpp"

namespace stx {
namespace {

using Json = nlohmann::json;

/// A number of an object, with the place in the message when it is none.
Result<double> numberAt(const Json& object, const std::string& key, const std::string& where) {
    const auto found = object.find(key);
    if (found == object.end())
        return failAt(where, ErrorCode::invalidInput, "'{}' is missing", key);
    if (!found->is_number() || !std::isfinite(found->get<double>()))
        return failAt(where, ErrorCode::invalidInput, "'{}' is {}; a finite number is expected",
                      key, found->dump());
    return found->get<double>();
}

/// fl_x fl_y cx cy w h of a frame, else of the file; fl_x from camera_angle_x when missing.
Result<Camera> transformsIntrinsics(const Json& file, const Json& frame, const std::string& where) {
    const auto get = [&](const char* key, std::optional<double>& out) -> Result<void> {
        for (const Json* from : {&frame, &file}) {
            if (!from->contains(key)) continue;
            STX_TRY(out, numberAt(*from, key, where));
            return {};
        }
        return {};
    };
    std::optional<double> w, h, fx, fy, cx, cy, angleX, angleY;
    STX_CHECK(get("w", w));
    STX_CHECK(get("h", h));
    STX_CHECK(get("fl_x", fx));
    STX_CHECK(get("fl_y", fy));
    STX_CHECK(get("cx", cx));
    STX_CHECK(get("cy", cy));
    STX_CHECK(get("camera_angle_x", angleX));
    STX_CHECK(get("camera_angle_y", angleY));
    Camera c;
    const double width = w.value_or(512), height = h.value_or(w.value_or(512));
    if (!(width >= 1 && width <= 65535 && height >= 1 && height <= 65535))
        return failAt(where, ErrorCode::invalidInput,
                      "'w' and 'h' are {} and {}; 1 to 65535 is possible", width, height);
    c.width = static_cast<int>(width);
    c.height = static_cast<int>(height);
    if (fx)
        c.fx = *fx;
    else if (angleX)
        c.fx = c.width * 0.5 / std::tan(*angleX * 0.5);
    else
        return failAt(where, ErrorCode::invalidInput,
                      "neither 'fl_x' nor 'camera_angle_x' is given");
    if (fy)
        c.fy = *fy;
    else if (angleY)
        c.fy = c.height * 0.5 / std::tan(*angleY * 0.5);
    else
        c.fy = c.fx;
    c.cx = cx.value_or(c.width * 0.5);
    c.cy = cy.value_or(c.height * 0.5);
    return c;
}

/// A 4x4 camera-to-world matrix, OpenGL axes, as rows.
Result<void> setPose(const Json& matrix, Camera& camera, const std::string& where) {
    glm::dmat4 m(1.0);
    const auto complain = [&] {
        return failAt(where, ErrorCode::invalidInput,
                      "'transform_matrix' must be 4 rows of 4 finite numbers");
    };
    if (!matrix.is_array() || matrix.size() < 3 || matrix.size() > 4) return complain();
    for (std::size_t r = 0; r < matrix.size(); ++r) {
        if (!matrix[r].is_array() || matrix[r].size() != 4) return complain();
        for (std::size_t k = 0; k < 4; ++k) {
            if (!matrix[r][k].is_number() || !std::isfinite(matrix[r][k].get<double>()))
                return complain();
            m[static_cast<int>(k)][static_cast<int>(r)] = matrix[r][k].get<double>();
        }
    }
    glm::dmat3 rotation(m);
    const double determinant = glm::determinant(rotation);
    if (!(determinant > 0))
        return failAt(where, ErrorCode::invalidInput,
                      "'transform_matrix' is no rotation (determinant {:g})", determinant);
    const double scale = std::cbrt(determinant);
    rotation /= scale;
    const glm::dmat3 error = rotation * glm::transpose(rotation) - glm::dmat3(1.0);
    for (int i = 0; i < 3; ++i) {
        if (glm::length(error[i]) > 0.02)
            return failAt(
                where, ErrorCode::invalidInput,
                "'transform_matrix' is sheared or scaled unevenly; a rotation is expected");
    }
    camera.orientation = glm::normalize(glm::quat_cast(rotation));
    camera.position = glm::dvec3(m[3]);
    return {};
}

Result<std::vector<NamedCamera>> fromTransforms(const Json& file) {
    std::vector<NamedCamera> out;
    const auto& frames = file["frames"];
    for (std::size_t i = 0; i < frames.size(); ++i) {
        const std::string where = fmt::format("frames[{}]", i);
        const auto& frame = frames[i];
        if (!frame.is_object())
            return failAt(where, ErrorCode::invalidInput, "an object is expected");
        STX_TRY(auto camera, transformsIntrinsics(file, frame, where));
        if (!frame.contains("transform_matrix"))
            return failAt(where, ErrorCode::invalidInput, "'transform_matrix' is missing");
        STX_CHECK(setPose(frame["transform_matrix"], camera, where));
        if (auto ok = camera.check(); !ok) return tl::unexpected(ok.error().at(where));
        const auto path = frame.value("file_path", Json());
        out.push_back(
            {path.is_string() ? path.get<std::string>() : fmt::format("frame{:03}", i), camera});
    }
    return out;
}

}  // namespace

Result<std::vector<NamedCamera>> readCameraFile(const std::filesystem::path& path, Job& job) {
    STX_TRY(const auto bytes, readFile(path, job.limits));
    const std::string where = fmt::format("'{}'", path.string());
    const auto* text = reinterpret_cast<const char*>(bytes.data());
    const Json file = Json::parse(text, text + bytes.size(), nullptr, false);
    if (file.is_discarded())
        return failAt(where, ErrorCode::invalidInput,
                      "this is no valid JSON; a transforms.json is expected");
    if (!file.is_object() || !file.contains("frames") || !file["frames"].is_array())
        return failAt(where, ErrorCode::invalidInput,
                      "there is no list 'frames'; a transforms.json is expected");
    auto cameras = fromTransforms(file);
    if (!cameras) return tl::unexpected(cameras.error().at(where));
    if (cameras->empty()) return failAt(where, ErrorCode::invalidInput, "there is no camera in it");
    return cameras;
}

}  // namespace stx
