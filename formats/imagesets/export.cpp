#include "formats/imagesets/export.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include <glm/gtc/constants.hpp>
#include <nlohmann/json.hpp>

#include "formats/exr/exr_file.hpp"
#include "formats/images/images.hpp"
#include "formats/imagesets/export_colmap.hpp"
#include "formats/imagesets/messages.hpp"
#include "lib/base/parallel.hpp"

namespace stx {
namespace {

using Json = nlohmann::ordered_json;
using imagesets::inQuotes;
using std::filesystem::path;

constexpr double kDegree = 180.0 / glm::pi<double>();

/// Names that are safe in any file system, each once.
std::vector<std::string> fileNames(const Bundle& bundle) {
    std::vector<std::string> names;
    std::set<std::string> taken;
    for (const ReferenceView& view : bundle.views) {
        std::string name;
        for (const char c : view.name) {
            const bool fine = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                              (c >= '0' && c <= '9') || c == '-' || c == '_';
            name += fine ? c : '_';
        }
        if (name.empty()) name = "view";
        name = name.substr(0, 100);
        std::string unique = name;
        for (int i = 2; !taken.insert(unique).second; ++i) unique = fmt::format("{}_{}", name, i);
        names.push_back(std::move(unique));
    }
    return names;
}

Result<void> writeExr(const path& file, int width, int height,
                      const std::vector<ExrConstPixels>& pixels) {
    ExrPart part;
    part.width = part.displayWidth = width;
    part.height = part.displayHeight = height;
    for (const ExrConstPixels& p : pixels)
        part.channels.push_back({p.channel, ExrChannel::Type::float32});
    STX_TRY(auto output, OutputFile::create(file));
    STX_TRY(auto writer, ExrWriter::create(output, {part}));
    STX_CHECK(writer.writePart(0, pixels));
    STX_CHECK(writer.finish());
    return output.commit();
}

/// Gives the file's ending.
Result<void> writeColour(const ReferenceView& view, const path& withoutEnding) {
    const int width = view.texture.width(), height = view.texture.height();
    if (const auto* bytes = view.texture.rgba8()) {
        STX_TRY(const auto png, encodePng(width, height, 4, 8, bytes->data(), true));
        return writeFile(path(withoutEnding) += ".png", png);
    }
    // OpenEXR's colours are premultiplied.
    RgbaFloatImage image = *view.texture.rgbaFloat();
    for (glm::vec4& c : image.pixels()) c = glm::vec4(glm::vec3(c) * c.a, c.a);
    const float* at = &image.data()->x;
    return writeExr(path(withoutEnding) += ".exr", width, height,
                    {{"R", at, 4}, {"G", at + 1, 4}, {"B", at + 2, 4}, {"A", at + 3, 4}});
}

const char* colourEnding(const ReferenceView& view) {
    return view.texture.isLinear() ? ".exr" : ".png";
}

Result<void> writeFloatDepth(const ReferenceView& view, const path& file) {
    return writeExr(file, view.depth.width(), view.depth.height(), {{"Z", view.depth.data(), 1}});
}

template <class Code>
Result<void> writeIntegerDepth(const ReferenceView& view, const path& file, const Code& code) {
    std::vector<std::uint16_t> codes(view.depth.count());
    for (std::size_t i = 0; i < codes.size(); ++i) {
        const float d = view.depth.data()[i];
        // A valid point never becomes "none".
        codes[i] = !hasPoint(d)
                       ? std::uint16_t{0}
                       : static_cast<std::uint16_t>(std::clamp(std::round(code(d)), 1.0, 65535.0));
    }
    STX_TRY(const auto png,
            encodePng(view.depth.width(), view.depth.height(), 1, 16, codes.data(), false));
    return writeFile(file, png);
}

/// What brings a view back to the bit; other programs do not look at it.
void addOwnKeys(Json& json, const ReferenceView& view, glm::dvec3 origin) {
    const glm::dquat& q = view.camera.orientation;
    json["stx:name"] = view.name;
    const glm::dvec3& p = view.camera.position;
    if (origin != glm::dvec3(0.0)) json["stx:position"] = {p.x, p.y, p.z};
    json["stx:quaternion"] = {q.x, q.y, q.z, q.w};
    json["nearPlane"] = view.nearPlane;
    json["farPlane"] = view.farPlane;
    json["depthBits"] = view.depthBits;
    if (view.pruned) json["stx:pruned"] = true;
    if (view.background) json["stx:background"] = true;
}

Json transformsFrame(const ReferenceView& view, const std::string& name, const char* depthEnding,
                     glm::dvec3 origin) {
    const Camera& c = view.camera;
    Json frame;
    frame["file_path"] = fmt::format("images/{}{}", name, colourEnding(view));
    frame["depth_file_path"] = fmt::format("depth/{}{}", name, depthEnding);
    frame["camera_model"] = c.orthographic ? "ORTHOGRAPHIC" : "PINHOLE";
    frame["w"] = c.width;
    frame["h"] = c.height;
    frame["fl_x"] = c.fx;
    frame["fl_y"] = c.fy;
    frame["cx"] = c.cx;
    frame["cy"] = c.cy;
    glm::dmat4 m = c.worldFromCamera();
    m[3] += glm::dvec4(origin, 0.0);
    for (int row = 0; row < 4; ++row)
        frame["transform_matrix"].push_back({m[0][row], m[1][row], m[2][row], m[3][row]});
    addOwnKeys(frame, view, origin);
    return frame;
}

/// yaw, pitch, roll in degrees: R = Ry(yaw) Rx(-pitch) Rz(-roll) in our axes.
glm::dvec3 mivRotation(const glm::dquat& orientation) {
    const glm::dmat3 m = glm::mat3_cast(orientation);  // m[column][row]
    const double sinB = std::clamp(-m[2][1], -1.0, 1.0);
    const double cosB = std::hypot(m[2][0], m[2][2]);
    const double b = std::atan2(sinB, cosB);
    double a = 0, c = 0;
    if (cosB > 1e-9) {
        a = std::atan2(m[2][0], m[2][2]);
        c = std::atan2(m[0][1], m[1][1]);
    } else {
        a = std::atan2(-m[0][2], m[0][0]);
    }
    return glm::dvec3(a, -b, -c) * kDegree;
}

/// MIV's range of a view, such that code 1 is the far plane and 0 stays free for "none".
struct MivRange {
    double nearest = 1, farthest = 2;
    [[nodiscard]] bool endless() const { return farthest >= 1000; }
    [[nodiscard]] double code(double z) const {
        const double s =
            endless() ? nearest / z : (1 / z - 1 / farthest) / (1 / nearest - 1 / farthest);
        return s * 65535;
    }
    /// The greatest rounding error, at z.
    [[nodiscard]] double errorAt(double z) const {
        return 0.5 / 65535 * z * z * (1 / nearest - (endless() ? 0 : 1 / farthest));
    }
};

Result<MivRange> mivRange(const ReferenceView& view) {
    if (!(view.nearPlane > 0))
        return fail(ErrorCode::invalidInput,
                    "view '{}': its near plane is at {:g}; MIV's depth needs one above 0",
                    view.name, view.nearPlane);
    const double step = 1.0 / 65535;
    const double inverse = (1 / view.farPlane - step / view.nearPlane) / (1 - step);
    MivRange range{view.nearPlane, inverse > 1e-3 ? 1 / inverse : 1000};
    return range;
}

Result<Json> mivCamera(const ReferenceView& view, const std::string& name, glm::dvec3 origin) {
    const Camera& c = view.camera;
    Json camera;
    camera["Name"] = name;
    const glm::dvec3 world = c.position + origin;
    camera["Position"] = {-world.z, -world.x, world.y};
    const glm::dvec3 rotation = mivRotation(c.orientation);
    camera["Rotation"] = {rotation.x, rotation.y, rotation.z};
    camera["Depthmap"] = 1;
    camera["Background"] = 0;
    STX_TRY(const MivRange range, mivRange(view));
    camera["Depth_range"] = {range.nearest, range.farthest};
    camera["HasInvalidDepth"] = true;
    camera["Resolution"] = {c.width, c.height};
    if (c.orthographic) {
        camera["Projection"] = "Orthographic";
        camera["Hor_range"] = {(c.cx - c.width) / c.fx, c.cx / c.fx};
        camera["Ver_range"] = {(c.cy - c.height) / c.fy, c.cy / c.fy};
    } else {
        camera["Projection"] = "Perspective";
        camera["Focal"] = {c.fx, c.fy};
        camera["Principle_point"] = {c.cx, c.cy};
    }
    camera["BitDepthColor"] = 8;
    camera["BitDepthDepth"] = 16;
    camera["ColorSpace"] = "YUV420";
    camera["DepthColorSpace"] = "YUV420";
    addOwnKeys(camera, view, origin);
    if (c.orthographic) camera["stx:window"] = {c.fx, c.fy, c.cx, c.cy};
    return camera;
}

}  // namespace

Result<void> exportImages(const Bundle& bundle, const path& folder, const ExportOptions& options,
                          Job& job) {
    STX_CHECK(bundle.check());
    const bool miv = options.kind == ExportOptions::Kind::miv;
    const auto names = fileNames(bundle);
    for (const ReferenceView& view : bundle.views)
        if (view.hasNormals() || view.hasSplats())
            job.note("normals and splats have no place in an image set and are left out");

    if (options.kind == ExportOptions::Kind::colmap)
        return imagesets::exportColmap(bundle, folder, names, options, job);

    Json json;
    double unit = 0.001;
    double farthest = 0;
    for (const ReferenceView& view : bundle.views) farthest = std::max(farthest, view.farPlane);
    if (miv) {
        json["Version"] = "2.0";
        json["Content_name"] = bundle.title;
        json["Fps"] = 30;
        json["Frames_number"] = 1;
        for (const std::string& name : names) json["sourceCameraNames"].push_back(name);
    } else {
        json["stx:title"] = bundle.title;
        if (!options.floatDepth) {
            // Millimetres where they reach, else the finest unit that does.
            if (farthest > unit * 65535) unit = farthest / 65535;
            json["integer_depth_scale"] = unit;
            job.note(fmt::format("depth is rounded to steps of {:.3g} scene units", unit));
        }
    }
    const glm::dvec3& o = bundle.origin;
    if (o != glm::dvec3(0.0)) json["stx:origin"] = {o.x, o.y, o.z};
    const char* depthEnding = options.floatDepth ? ".exr" : ".png";
    for (std::size_t i = 0; i < bundle.views.size(); ++i) {
        const ReferenceView& view = bundle.views[i];
        if (!miv) {
            json["frames"].push_back(transformsFrame(view, names[i], depthEnding, bundle.origin));
            continue;
        }
        STX_TRY(auto camera, mivCamera(view, names[i], bundle.origin));
        json["cameras"].push_back(std::move(camera));
        if (!options.floatDepth) {
            STX_TRY(const MivRange range, mivRange(view));
            job.note(fmt::format("view '{}': depth is rounded by up to {:.2g} scene units",
                                 view.name, range.errorAt(view.farPlane)));
        }
    }
    std::string text;
    try {
        text = json.dump(1) + "\n";
    } catch (const std::exception&) {
        return fail(ErrorCode::invalidInput, "the title or a view's name is no valid UTF-8");
    }

    std::vector<std::string> own;
    for (std::size_t i = 0; i < names.size(); ++i) {
        const ReferenceView& view = bundle.views[i];
        if (miv) {
            own.push_back(fmt::format("{}_color{}", names[i], colourEnding(view)));
            own.push_back(names[i] + (options.floatDepth ? "_depth.exr" : "_depth16.png"));
        } else {
            own.push_back(fmt::format("images/{}{}", names[i], colourEnding(view)));
            own.push_back(fmt::format("depth/{}{}", names[i], depthEnding));
        }
    }
    own.emplace_back(miv ? "cameras.json" : "transforms.json");
    STX_TRY(auto output, OutputFolder::create(folder, {options.noClobber}, own));
    const path& root = output.temporaryPath();
    std::error_code ec;
    if (!miv) {
        for (const char* sub : {"images", "depth"}) {
            std::filesystem::create_directory(root / sub, ec);
            if (ec)
                return failAt(inQuotes(folder.string()), ErrorCode::io, "cannot be written: {}",
                              ec.message());
        }
    }
    std::vector<Result<void>> written(bundle.views.size());
    parallelFor(0, static_cast<std::int64_t>(bundle.views.size()), [&](std::int64_t index) {
        const auto i = static_cast<std::size_t>(index);
        const ReferenceView& view = bundle.views[i];
        const auto write = [&]() -> Result<void> {
            STX_CHECK(job.checkCancelled());
            STX_CHECK(writeColour(view, root / (miv ? names[i] + "_color" : "images/" + names[i])));
            if (options.floatDepth)
                return writeFloatDepth(
                    view, root / (miv ? names[i] + "_depth.exr" : "depth/" + names[i] + ".exr"));
            if (!miv)
                return writeIntegerDepth(view, root / ("depth/" + names[i] + ".png"),
                                         [&](double d) { return d / unit; });
            STX_TRY(const MivRange range, mivRange(view));
            return writeIntegerDepth(view, root / (names[i] + "_depth16.png"),
                                     [&](double d) { return range.code(d); });
        };
        written[i] = write();
    });
    for (auto& result : written)
        if (!result) return propagate(result);
    STX_CHECK(writeFile(root / own.back(), std::as_bytes(std::span(text.data(), text.size()))));
    return output.commit();
}

}  // namespace stx
