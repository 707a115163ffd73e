#include <glm/glm.hpp>

#include "formats/any/info.hpp"
#include "formats/any/info_agreement.hpp"
#include "formats/any/info_memory.hpp"
#include "formats/any/info_photo.hpp"
#include "lib/base/counted.hpp"
#include "lib/base/printable.hpp"

namespace stx {
namespace {

using Json = nlohmann::ordered_json;

/// What a view sees, in the units that options take.
std::string lensText(const Json& view) {
    const double x = view["fieldOfView"][0].get<double>(), y = view["fieldOfView"][1].get<double>();
    if (view["orthographic"].get<bool>())
        return fmt::format("orthographic, window {:.6g} x {:.6g}", x, y);
    return fmt::format("perspective, field of view {:.4g} x {:.4g} degrees", glm::degrees(x),
                       glm::degrees(y));
}

/// A value as it is shown: text without what moves a terminal's cursor.
std::string shown(const Json& v) {
    return v.is_string() ? printable(v.get_ref<const std::string&>()) : v.dump();
}

std::string timeText(const Json& info) {
    return fmt::format(
        "duration: {:.6g} s{}{}\n", info["duration"].get<double>(),
        info.contains("start") ? fmt::format(" from {:.12g} s", info["start"].get<double>()) : "",
        info.contains("rate") ? fmt::format(", {:.6g} frames a second", info["rate"].get<double>())
                              : "");
}

std::string splatsText(const Json& s) {
    return fmt::format(
        "splats: {}, {} with an opacity below 0.1, harmonics of degree {}, {} colours, up is "
        "{}\n",
        shown(s["count"]), shown(s["nearlyTransparent"]), shown(s["degree"]),
        shown(s["colourSpace"]), shown(s["up"]));
}

std::string environmentText(const Json& e) {
    std::string out = fmt::format("environment: {}", shown(e["layout"]));
    if (e.contains("width")) out += fmt::format(", {}x{}", shown(e["width"]), shown(e["height"]));
    if (e.contains("faces")) out += fmt::format(", {} faces", e["faces"].size());
    for (const auto& [key, what] : {std::pair{"skyColours", "sky"}, {"groundColours", "ground"}})
        if (e[key] > 0)
            out += fmt::format(", {} of {}", what, counted(e[key].get<std::size_t>(), "colour"));
    if (e["orientation"][3] != 0.0) out += fmt::format(", turned by {}", shown(e["orientation"]));
    return out + "\n";
}

std::string textureText(const Json& t) {
    return fmt::format(
        "texture {}: {}x{}{}{}\n", shown(t["attribute"]), shown(t["width"]), shown(t["height"]),
        t.contains("coding") ? ", " + shown(t["coding"]) : "",
        t.contains("bytes") && t["bytes"] > 0 ? fmt::format(", {} bytes", shown(t["bytes"])) : "");
}

std::string objectText(const Json& o) {
    return fmt::format("object '{}': {} from view {} on, {:.1f} % of the textures\n",
                       shown(o["name"]), counted(o["views"].get<int>(), "view"),
                       shown(o["firstView"]), 100 * o["used"].get<double>());
}

std::string setViewText(std::size_t number, const Json& v) {
    std::string out = fmt::format("view {} '{}': {}x{}", number, shown(v["name"]),
                                  shown(v["width"]), shown(v["height"]));
    if (v.contains("colour")) out += fmt::format(", colour {}", shown(v["colour"]));
    if (v.contains("depth")) out += fmt::format(", depth {}", shown(v["depth"]));
    if (v.contains("missing"))
        for (const auto& name : v["missing"]) out += fmt::format(", {} is missing", shown(name));
    if (v.contains("lost")) out += ", without a camera: tracking was lost";
    return out + "\n";
}

std::string viewText(std::size_t number, const Json& v) {
    return fmt::format(
        "view {} '{}': {}x{}, {}-bit depth {:.6g}..{:.6g}, {}, at {:.10g} {:.10g} "
        "{:.10g}{}{}{}{}{}{}{}{}\n",
        number, shown(v["name"]), shown(v["width"]), shown(v["height"]), shown(v["depthBits"]),
        v["nearPlane"].get<double>(), v["farPlane"].get<double>(), lensText(v),
        v["position"][0].get<double>(), v["position"][1].get<double>(),
        v["position"][2].get<double>(),
        v.contains("points") ? fmt::format(", {} points", shown(v["points"])) : "",
        v.contains("metallicRoughness") ? ", metallic-roughness" : "",
        v.contains("emissive") ? ", emissive" : "",
        v.value("noDepth", "") == "unknown" ? ", no depth: unknown" : "",
        v.contains("refined") ? fmt::format(", refined ({})", shown(v["refined"])) : "",
        v.contains("moved") ? ", moved" : "", v.contains("pruned") ? ", pruned" : "",
        v.contains("background") ? ", background" : "");
}

std::string streamText(const Json& s) {
    return fmt::format(
        "{} '{}': {} bytes{}\n", shown(s["kind"]), shown(s["name"]), shown(s["bytes"]),
        s.contains("time") ? fmt::format(", from {:g} s on", s["time"].get<double>()) : "");
}

}  // namespace

std::string describeAsText(const Json& info) {
    std::string out = fmt::format("{}: {}, {} bytes\n", shown(info["file"]),
                                  shown(info["container"]), shown(info["bytes"]));
    for (const char* key : {"object", "imageSet", "nodeKind", "title", "frames", "missing",
                            "triangles", "vertices", "materials", "points", "used"}) {
        if (info.contains(key) && !(key == std::string_view("frames") && info[key] == 1))
            out += fmt::format("{}: {}\n", key, shown(info[key]));
    }
    const auto each = [&](const char* key, auto&& text) {
        if (info.contains(key))
            for (const auto& item : info[key]) out += text(item);
    };
    if (info.contains("duration")) out += timeText(info);
    if (info.contains("splats")) out += splatsText(info["splats"]);
    if (info.contains("origin")) out += fmt::format("origin: {}\n", shown(info["origin"]));
    if (info.contains("bounds"))
        out += fmt::format("bounds: {} to {}\n", shown(info["bounds"]["min"]),
                           shown(info["bounds"]["max"]));
    if (info.contains("environment")) out += environmentText(info["environment"]);
    if (info.contains("pixels"))
        out += fmt::format("pixels: {} of {} kept\n", shown(info["pixels"]["kept"]),
                           shown(info["pixels"]["source"]));
    each("textures", textureText);
    each("objects", objectText);
    if (info.contains("photo")) out += photoText(info["photo"]);
    if (info.contains("views") && info["views"].empty())
        out += "no views: the scene shows no DepthImage with images\n";
    std::size_t number = 0;
    each("views", [&](const Json& v) {
        const bool ofImageSet = !v.contains("nearPlane");
        return ofImageSet ? setViewText(number++, v) : viewText(number++, v);
    });
    each("streams", streamText);
    if (info.contains("agreement")) out += agreementText(info["agreement"]);
    if (info.contains("memory")) out += memoryText(info["memory"]);
    return out;
}

}  // namespace stx
