#pragma once

#include <filesystem>

#include <glm/gtc/quaternion.hpp>
#include <nlohmann/json.hpp>

#include "formats/files/files.hpp"
#include "formats/images/images.hpp"
#include "lib/model/bundle.hpp"

namespace stx::spheres {

inline Camera cameraFrom(const nlohmann::json& c) {
    const auto& p = c.at("Position");
    const auto& r = c.at("Rotation");
    const auto turn = [&](glm::dvec3 axis, double degrees) {
        return glm::angleAxis(glm::radians(degrees), axis);
    };
    Camera camera;
    camera.position = {-p[1].get<double>(), p[2].get<double>(), -p[0].get<double>()};
    camera.orientation =
        glm::normalize(turn({0, 1, 0}, r[0]) * turn({1, 0, 0}, -r[1].get<double>()) *
                       turn({0, 0, 1}, -r[2].get<double>()));
    camera.width = c.at("Resolution")[0];
    camera.height = c.at("Resolution")[1];
    camera.fx = c.at("Focal")[0];
    camera.fy = c.at("Focal")[1];
    camera.cx = c.at("Principle_point")[0];
    camera.cy = c.at("Principle_point")[1];
    return camera;
}

inline Result<DecodedImage> decodeFile(const std::filesystem::path& path) {
    STX_TRY(const Bytes bytes, readFile(path, Limits{}));
    return decodeImage(bytes, path.filename().string(), Limits{});
}

/// The four sources of data/imagesets/spheres-miv, with float depth, and the camera of a novel
/// view.
inline Result<Bundle> load(const std::filesystem::path& folder, const std::string& novel,
                           Camera& camera) {
    STX_TRY(const Bytes text, readFile(folder / "cameras.json", Limits{}));
    const auto json = nlohmann::json::parse(text.begin(), text.end());
    Bundle bundle;
    for (const auto& c : json.at("cameras")) {
        const std::string name = c.at("Name");
        if (name == novel) camera = cameraFrom(c);
        if (!std::filesystem::exists(folder / (name + "_depth16.png"))) continue;
        ReferenceView v;
        v.name = name;
        v.camera = cameraFrom(c);
        v.depthBits = 32;
        v.nearPlane = 1;
        v.farPlane = 20;
        STX_TRY(const DecodedImage colour, decodeFile(folder / (name + "_color.png")));
        v.texture = rgba8From(colour);
        STX_TRY(const DecodedImage depth, decodeFile(folder / (name + "_depth16.png")));
        const auto* codes = std::get_if<std::vector<std::uint16_t>>(&depth.values);
        if (!codes) return fail(ErrorCode::invalidInput, "depth is not 16-bit");
        v.depth = Image<float>(depth.width, depth.height);
        for (std::size_t i = 0; i < v.depth.count(); ++i)
            v.depth.pixels()[i] =
                static_cast<float>(20.0 / (1.0 + (*codes)[i * depth.channels] / 65535.0 * 19.0));
        bundle.views.push_back(std::move(v));
    }
    return bundle;
}

}  // namespace stx::spheres
