#include "formats/any/info_photo.hpp"

#include <cmath>

#include "lib/base/printable.hpp"

namespace stx {

using Json = nlohmann::ordered_json;

Json photoJson(const photos::Photo& photo, const Camera& camera, const std::string& from) {
    const glm::ivec2 depth = photo.uprightSize(photo.depth);
    Json out = {{"format", photo.format},
                {"colour", photo.colourIs},
                {"depth",
                 {{"width", depth.x},
                  {"height", depth.y},
                  {"coding", printable(photo.coding)},
                  {"accuracy", photo.accuracy}}},
                {"camera",
                 {{"from", from},
                  {"fx", camera.fx},
                  {"fy", camera.fy},
                  {"cx", camera.cx},
                  {"cy", camera.cy}}}};
    if (photo.code.scaled()) {
        const auto distance = [&](double a) {
            return !photo.code.inverse ? a : a > 0 ? 1 / a : INFINITY;
        };
        const double a = distance(photo.code.zero), b = distance(photo.code.one);
        out["depth"]["near"] = std::min(a, b);
        // JSON has no infinity.
        if (std::isfinite(std::max(a, b))) out["depth"]["far"] = std::max(a, b);
    }
    if (photo.focal35 > 0) out["camera"]["focal35"] = photo.focal35;
    out["mattes"] = Json::array();
    for (const std::string& name : photo.mattes) out["mattes"].push_back(printable(name));
    out["others"] = photo.others;
    return out;
}

std::string photoText(const Json& photo) {
    const auto text = [](const Json& value) { return value.get<std::string>(); };
    const Json &depth = photo["depth"], &camera = photo["camera"];
    const std::string colour = text(photo["colour"]);
    std::string out = fmt::format("photo: {}, {}\n", text(photo["format"]),
                                  colour == "original"   ? "the sharp original is used"
                                  : colour == "portrait" ? "the blurred portrait is used"
                                                         : "one picture");
    out += fmt::format("depth: {}x{}, {}, {}", depth["width"].get<int>(),
                       depth["height"].get<int>(), text(depth["coding"]), text(depth["accuracy"]));
    if (depth.contains("near"))
        out += fmt::format(", from {:.6g} to {}", depth["near"].get<double>(),
                           depth.contains("far") ? fmt::format("{:.6g}", depth["far"].get<double>())
                                                 : std::string("infinity"));
    const std::string from = text(camera["from"]);
    out += fmt::format(
        "\ncamera: fx {:.6g} fy {:.6g} cx {:.6g} cy {:.6g}, {}\n", camera["fx"].get<double>(),
        camera["fy"].get<double>(), camera["cx"].get<double>(), camera["cy"].get<double>(),
        from == "matrix" ? "of the file's matrix"
        : from == "focal35"
            ? fmt::format("of EXIF's {:g} mm (35 mm camera)", camera["focal35"].get<double>())
        : from == "given" ? "as given"
                          : "assumed");
    for (const char* list : {"mattes", "others"}) {
        std::string names;
        for (const Json& name : photo[list]) names += (names.empty() ? "" : ", ") + text(name);
        if (!names.empty()) out += fmt::format("{}: {}\n", list, names);
    }
    return out;
}

}  // namespace stx
