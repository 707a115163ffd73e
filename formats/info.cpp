#include "formats/info.hpp"

#include "formats/atlas/atlas_files.hpp"
#include "formats/exr/bundle_exr.hpp"
#include "formats/meshes/meshes.hpp"
#include "formats/mpeg4/mpeg4.hpp"
#include "formats/open.hpp"
#include "lib/base/printable.hpp"
#include "lib/packing/packing.hpp"

namespace stx {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

Json vectorJson(glm::dvec3 v) {
    return {v.x, v.y, v.z};
}

Json boundsJson(const Bounds& b) {
    return {{"min", vectorJson(b.min)}, {"max", vectorJson(b.max)}};
}

Json viewJson(const ReferenceView& view) {
    const auto axisAngle = axisAngleFromQuat(view.camera.orientation);
    const auto fov = view.camera.fieldOfView();
    Json j = {{"name", view.name},
              {"width", view.camera.width},
              {"height", view.camera.height},
              {"depthBits", view.depthBits},
              {"position", vectorJson(view.camera.position)},
              {"orientation", {axisAngle.x, axisAngle.y, axisAngle.z, axisAngle.w}},
              {"fieldOfView", {fov.x, fov.y}},
              {"nearPlane", view.nearPlane},
              {"farPlane", view.farPlane},
              {"orthographic", view.camera.orthographic}};
    if (!view.camera.centred(1e-6))
        j["intrinsics"] = {{"fx", view.camera.fx},
                           {"fy", view.camera.fy},
                           {"cx", view.camera.cx},
                           {"cy", view.camera.cy}};
    return j;
}

/// Fills in what only the pixels show.
void addFromPixels(Json& out, const Bundle& bundle) {
    std::int64_t points = 0;
    for (std::size_t i = 0; i < bundle.views.size() && i < out["views"].size(); ++i) {
        const auto n = bundle.views[i].pointCount();
        out["views"][i]["points"] = n;
        points += n;
    }
    out["points"] = points;
    if (!out.contains("bounds"))
        out["bounds"] = boundsJson(bundle.bounds ? *bundle.bounds : bundle.computeBounds());
}

Result<void> describeExr(const fs::path& path, Json& out, Job& job) {
    STX_TRY(const auto header, readExrBundleHeader(path, job.limits));
    out["container"] = "exr";
    out["nodeKind"] = header.nodeKind();
    if (!header.title.empty()) out["title"] = header.title;
    auto views = Json::array();
    auto streams = Json::array();
    std::int64_t points = 0;
    for (const auto& v : header.views) {
        auto j = viewJson(v.view);
        if (v.points >= 0) j["points"] = v.points;
        points = v.points < 0 || points < 0 ? -1 : points + v.points;
        j["normals"] = v.normals;
        j["splats"] = v.splats;
        j["bytes"] = v.bytes;
        views.push_back(std::move(j));
        streams.push_back({{"name", v.view.name}, {"kind", "part"}, {"bytes", v.bytes}});
    }
    out["views"] = std::move(views);
    if (points >= 0) out["points"] = points;
    if (header.bounds) out["bounds"] = boundsJson(*header.bounds);
    out["streams"] = std::move(streams);
    return {};
}

const char* streamKind(const mpeg4::ElementaryStream& stream) {
    switch (stream.objectTypeIndication) {
        case mpeg4::oti::kJpeg:
            return "jpeg";
        case mpeg4::oti::kPng:
            return "png";
        default:
            return "stream";
    }
}

Result<void> describeMpeg4(const fs::path& path, Json& out, Job& job) {
    STX_TRY(const auto document, readMpeg4(path, job));
    const auto container = mpeg4ContainerOf(path).value_or(Mpeg4Container::mp4);
    out["container"] = container == Mpeg4Container::bt    ? "bt"
                       : container == Mpeg4Container::xmt ? "xmt"
                                                          : "mp4";
    mpeg4::SceneReadOptions options;
    options.folder = path.parent_path();
    options.pixels = false;
    STX_TRY(const auto bundle, mpeg4::bundleFromScene(document, options, job));
    out["nodeKind"] = mpeg4::nodeKindOf(document);
    if (!bundle.title.empty()) out["title"] = bundle.title;
    auto views = Json::array();
    for (const auto& v : bundle.views) views.push_back(viewJson(v));
    out["views"] = std::move(views);
    if (bundle.bounds) out["bounds"] = boundsJson(*bundle.bounds);
    auto streams = Json::array();
    const auto add = [&](const mpeg4::ElementaryStream& stream, const std::string& name,
                         const char* kind) {
        std::uint64_t bytes = 0;
        for (const auto& sample : stream.samples) bytes += sample.data.size;
        streams.push_back({{"name", name}, {"kind", kind}, {"bytes", bytes}});
    };
    if (!document.sceneStream.samples.empty()) add(document.sceneStream, "scene", "bifs");
    if (!document.odStream.samples.empty()) add(document.odStream, "object descriptors", "od");
    for (const auto* descriptor : document.objectDescriptors()) {
        for (const auto& stream : descriptor->streams)
            add(stream, fmt::format("od {}", descriptor->id), streamKind(stream));
    }
    out["streams"] = std::move(streams);
    return {};
}

Result<void> describeAtlas(const fs::path& path, Json& out, Job& job) {
    STX_TRY(const auto header, readAtlasHeader(path, job.limits));
    out["container"] =
        fs::is_regular_file(path) && path.extension() == ".exr" ? "atlas-exr" : "atlas";
    bool second = false;
    auto textures = Json::array();
    for (const auto& t : header.textures) {
        second = second || t.attribute == "normal" || t.attribute == "splat";
        textures.push_back({{"attribute", t.attribute},
                            {"width", t.width},
                            {"height", t.height},
                            {"page", t.page},
                            {"file", t.file},
                            {"coding", t.coding},
                            {"bytes", t.bytes}});
    }
    out["nodeKind"] = second ? "SimpleTextureV2" : "SimpleTexture";
    if (!header.atlas.title.empty()) out["title"] = header.atlas.title;
    auto views = Json::array();
    for (const auto& v : header.atlas.views) views.push_back(viewJson(v));
    out["views"] = std::move(views);
    out["textures"] = std::move(textures);
    auto rectangles = Json::array();
    for (const auto& r : header.atlas.rectangles)
        rectangles.push_back({{"view", r.view},
                              {"page", r.page},
                              {"viewX", r.viewX},
                              {"viewY", r.viewY},
                              {"width", r.width},
                              {"height", r.height},
                              {"atlasX", r.atlasX},
                              {"atlasY", r.atlasY},
                              {"turned", r.turned}});
    out["rectangles"] = std::move(rectangles);
    out["used"] = header.used();
    out["pixels"] = {{"source", header.atlas.sourcePixels}, {"kept", header.atlas.keptPixels}};
    if (header.atlas.bounds) out["bounds"] = boundsJson(*header.atlas.bounds);
    return {};
}

}  // namespace

Result<Json> describe(const fs::path& path, const InfoOptions& options, Job& job) {
    STX_TRY(const auto kind, recognise(path));
    Json out = {{"$schema", "info.schema.json"}, {"file", path.string()}};
    std::error_code ec;
    std::uint64_t bytes = 0;
    if (fs::is_directory(path, ec)) {
        for (const auto& entry : fs::directory_iterator(path, ec)) {
            if (entry.is_regular_file(ec)) bytes += entry.file_size(ec);
        }
    } else {
        bytes = fs::file_size(path, ec);
    }
    out["bytes"] = bytes;
    switch (kind) {
        case FileKind::exr:
            STX_CHECK(describeExr(path, out, job));
            break;
        case FileKind::mpeg4:
            STX_CHECK(describeMpeg4(path, out, job));
            break;
        case FileKind::atlas:
            STX_CHECK(describeAtlas(path, out, job));
            break;
        case FileKind::mesh: {
            STX_TRY(const auto mesh, readMesh(path, job));
            out["container"] = "mesh";
            out["triangles"] = mesh.triangles.size();
            out["vertices"] = mesh.positions.size();
            out["points"] = mesh.points.size();
            out["materials"] = mesh.materials.size();
            auto textures = Json::array();
            for (const auto& t : mesh.textures)
                textures.push_back({{"attribute", "colour"},
                                    {"width", t.pixels.width()},
                                    {"height", t.pixels.height()}});
            out["textures"] = std::move(textures);
            out["bounds"] = boundsJson(mesh.bounds());
            return out;
        }
        case FileKind::imageSet:
        case FileKind::image:
        case FileKind::unknown:
            return fail(ErrorCode::invalidInput, "'{}' is neither a mesh, a bundle nor an atlas",
                        path.string());
    }
    if (options.bounds && (!out.contains("bounds") || !out.contains("points"))) {
        STX_TRY(const auto bundle, openBundle(path, {}, job));
        addFromPixels(out, bundle);
    }
    return out;
}

namespace {

/// What a view sees, in the units that options take.
std::string lensText(const Json& view) {
    const double x = view["fieldOfView"][0].get<double>(), y = view["fieldOfView"][1].get<double>();
    if (view["orthographic"].get<bool>())
        return fmt::format("orthographic, window {:.6g} x {:.6g}", x, y);
    return fmt::format("perspective, field of view {:.4g} x {:.4g} degrees", glm::degrees(x),
                       glm::degrees(y));
}

}  // namespace

std::string describeAsText(const Json& info) {
    const auto text = [](const Json& v) {
        return v.is_string() ? printable(v.get_ref<const std::string&>()) : v.dump();
    };
    std::string out = fmt::format("{}: {}, {} bytes\n", text(info["file"]), text(info["container"]),
                                  text(info["bytes"]));
    for (const char* key :
         {"nodeKind", "title", "triangles", "vertices", "materials", "points", "used"}) {
        if (info.contains(key)) out += fmt::format("{}: {}\n", key, text(info[key]));
    }
    if (info.contains("bounds"))
        out += fmt::format("bounds: {} to {}\n", text(info["bounds"]["min"]),
                           text(info["bounds"]["max"]));
    if (info.contains("pixels"))
        out += fmt::format("pixels: {} of {} kept\n", text(info["pixels"]["kept"]),
                           text(info["pixels"]["source"]));
    if (info.contains("textures")) {
        for (const auto& t : info["textures"])
            out += fmt::format(
                "texture {}: {}x{}{}{}\n", text(t["attribute"]), text(t["width"]),
                text(t["height"]), t.contains("coding") ? ", " + text(t["coding"]) : "",
                t.contains("bytes") && t["bytes"] > 0 ? fmt::format(", {} bytes", text(t["bytes"]))
                                                      : "");
    }
    if (info.contains("views")) {
        std::size_t i = 0;
        for (const auto& v : info["views"]) {
            out += fmt::format(
                "view {} '{}': {}x{}, {}-bit depth {:.6g}..{:.6g}, {}, at {:.10g} {:.10g} "
                "{:.10g}{}\n",
                i++, text(v["name"]), text(v["width"]), text(v["height"]), text(v["depthBits"]),
                v["nearPlane"].get<double>(), v["farPlane"].get<double>(), lensText(v),
                v["position"][0].get<double>(), v["position"][1].get<double>(),
                v["position"][2].get<double>(),
                v.contains("points") ? fmt::format(", {} points", text(v["points"])) : "");
        }
    }
    if (info.contains("streams")) {
        for (const auto& s : info["streams"])
            out += fmt::format("{} '{}': {} bytes\n", text(s["kind"]), text(s["name"]),
                               text(s["bytes"]));
    }
    return out;
}

}  // namespace stx
