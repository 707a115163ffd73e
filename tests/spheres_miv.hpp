#pragma once

#include <filesystem>
#include <string>

#include "lib/model/bundle.hpp"
#include "tests/plain_files.hpp"

/// The image set spheres-miv of the shared data, read as plain_files.hpp says.
namespace spheres {

using plain::decoded;
using plain::picture;

/// MIV: x forward, y left, z up; rotation yaw, pitch, roll in degrees.
inline stx::Camera camera(const nlohmann::json& j) {
    stx::Camera c;
    const auto number = [&](const char* key, int i) { return j[key][i].get<double>(); };
    c.position = {-number("Position", 1), number("Position", 2), -number("Position", 0)};
    const auto turn = [&](glm::dvec3 axis, double degrees) {
        return stx::quatFromAxisAngle({axis, glm::radians(degrees)});
    };
    c.orientation = turn({0, 1, 0}, number("Rotation", 0)) *
                    turn({1, 0, 0}, -number("Rotation", 1)) *
                    turn({0, 0, 1}, -number("Rotation", 2));
    c.width = j["Resolution"][0];
    c.height = j["Resolution"][1];
    c.fx = number("Focal", 0);
    c.fy = number("Focal", 1);
    c.cx = number("Principle_point", 0);
    c.cy = number("Principle_point", 1);
    return c;
}

inline stx::Camera cameraNamed(const nlohmann::json& set, const std::string& name) {
    for (const auto& j : set["cameras"])
        if (j["Name"] == name) return camera(j);
    ADD_FAILURE() << "no camera " << name;
    return {};
}

inline nlohmann::json cameras(const std::filesystem::path& folder) {
    return plain::json(folder / "cameras.json");
}

/// The four sources v0 to v3.
inline stx::Bundle bundle(const std::filesystem::path& folder) {
    const auto set = cameras(folder);
    stx::Bundle out;
    for (const std::string name : {"v0", "v1", "v2", "v3"}) {
        stx::ReferenceView v;
        v.name = name;
        v.camera = cameraNamed(set, name);
        v.nearPlane = 1;
        v.farPlane = 20;
        v.texture = picture(folder / (name + "_color.png"));
        const auto codes = decoded(folder / (name + "_depth16.png"));
        v.depth = stx::Image<float>(codes.width, codes.height);
        const auto& values = std::get<std::vector<std::uint16_t>>(codes.values);
        for (std::size_t i = 0; i < values.size(); ++i)
            v.depth.pixels()[i] = static_cast<float>(20.0 / (1.0 + values[i] / 65535.0 * 19.0));
        out.views.push_back(std::move(v));
    }
    return out;
}

}  // namespace spheres
