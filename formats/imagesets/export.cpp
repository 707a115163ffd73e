#include "formats/imagesets/export.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include <glm/gtc/constants.hpp>
#include <nlohmann/json.hpp>

#include "formats/exr/environment_exr.hpp"
#include "formats/files/messages.hpp"
#include "formats/imagesets/export_colmap.hpp"
#include "formats/imagesets/export_files.hpp"
#include "lib/base/counted.hpp"
#include "lib/model/some_views.hpp"

namespace stx {
namespace {

using namespace imagesets;

using std::filesystem::path;

constexpr double kDegree = 180.0 / glm::pi<double>();

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

/// The farthest distance that MIV takes for infinite, and so do all above it: code 0 is there.
constexpr double kMivEndless = 1000;

/// MIV's range of a view, such that code 1 is the far plane and 0 stays free for "none".
struct MivRange {
    double nearest = 1, farthest = 2;
    [[nodiscard]] bool endless() const { return farthest >= kMivEndless; }
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
    if (inverse > 0) return MivRange{view.nearPlane, 1 / inverse};
    // No code is left for the far plane: those of an endless range come nearest to it.
    return MivRange{view.nearPlane, std::max(view.farPlane, kMivEndless)};
}

Result<OutputJson> mivCamera(const ReferenceView& view, const std::string& name,
                             glm::dvec3 origin) {
    const Camera& c = view.camera;
    OutputJson camera;
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

/// The file that names the cameras, and the unit of integer depth (scene units).
struct Head {
    OutputJson json;
    double unit = 0.001;
};

Result<Head> headOf(const ViewTable& table, const std::vector<std::string>& names,
                    const ExportOptions& options, Job& job) {
    const Bundle& bundle = table.about();
    const bool miv = options.kind == ExportOptions::Kind::miv;
    const bool floats = options.depth != ExportOptions::Depth::png;
    Head head;
    if (miv) {
        head.json["Version"] = "2.0";
        head.json["Content_name"] = bundle.title;
        head.json["Fps"] = 30;
        head.json["Frames_number"] = 1;
        for (const std::string& name : names) head.json["sourceCameraNames"].push_back(name);
    } else {
        head.json["stx:title"] = bundle.title;
        if (!floats) {
            double farthest = 0;
            for (const ReferenceView& view : bundle.views)
                farthest = std::max(farthest, view.farPlane);
            head.unit = integerDepthUnit(farthest, {}, job);
            head.json["integer_depth_scale"] = head.unit;
        }
    }
    const glm::dvec3& o = bundle.origin;
    if (o != glm::dvec3(0.0)) head.json["stx:origin"] = {o.x, o.y, o.z};
    if (bundle.environment) head.json["stx:environment"] = kEnvironmentFile;
    for (std::size_t i = 0; i < bundle.views.size(); ++i) {
        const ReferenceView& view = bundle.views[i];
        if (!miv) {
            head.json["frames"].push_back(
                transformsFrame(view, table.kindsOf(i).linear, names[i], options, bundle.origin));
            continue;
        }
        STX_TRY(auto camera, mivCamera(view, names[i], bundle.origin));
        head.json["cameras"].push_back(std::move(camera));
        if (!floats) {
            STX_TRY(const MivRange range, mivRange(view));
            job.note(fmt::format("view '{}': depth is rounded by up to {:.2g} scene units",
                                 view.name, range.errorAt(view.farPlane)));
        }
    }
    return head;
}

/// The views that are photographs, for COLMAP, which has no mark for background views: what reads a
/// workspace would take them for photographs of the same moment. Null: all are. The table must
/// outlive it.
Result<std::unique_ptr<ViewTable>> withoutBackgrounds(const ViewTable& table, Job& job) {
    const std::vector<ReferenceView>& views = table.about().views;
    std::vector<std::size_t> kept;
    for (std::size_t i = 0; i < views.size(); ++i)
        if (!views[i].background) kept.push_back(i);
    if (kept.size() == views.size()) return nullptr;
    if (kept.empty())
        return fail(ErrorCode::invalidInput,
                    "all views are background views, for which COLMAP's workspace has no mark; "
                    "--cameras transforms keeps it");
    const std::size_t left = views.size() - kept.size();
    job.note(
        fmt::format("{} {} left out: COLMAP's workspace has no mark for them, and what reads "
                    "it would take them for photographs (--cameras transforms keeps them)",
                    counted(left, "background view"), left == 1 ? "is" : "are"));
    return someViewsOf(table, std::move(kept));
}

}  // namespace

Result<void> exportViews(const ViewTable& table, const path& folder, const ExportOptions& options,
                         Job& job) {
    if (options.kind == ExportOptions::Kind::colmap) {
        STX_TRY(const auto others, withoutBackgrounds(table, job));
        if (others) return exportViews(*others, folder, options, job);
    }
    // Units and ranges follow from all planes.
    if (!table.planesKnown()) {
        STX_TRY(const auto whole, wholeBundle(table, job));
        return exportViews(*viewsOf(whole), folder, options, job);
    }
    const Bundle& bundle = table.about();
    if (options.depth == ExportOptions::Depth::npy &&
        options.kind != ExportOptions::Kind::transforms)
        return fail(ErrorCode::usage, "depth as .npy is of transforms.json; take exr or png");
    const auto names = fileNames(bundle);
    for (const ViewImageKinds& kinds : table.kinds())
        if (kinds.normal || kinds.hasSplats())
            job.note("normals and splats have no place in an image set and are left out");
    noteMaterialLeftOut(table, job);

    if (options.kind == ExportOptions::Kind::colmap && bundle.environment)
        job.note("COLMAP's workspace has no place for the environment: it is left out");
    if (options.kind == ExportOptions::Kind::colmap)
        return exportColmap(table, folder, names, options, job);

    STX_TRY(const auto head, headOf(table, names, options, job));
    STX_TRY(const std::string text, setText(head.json));
    const bool miv = options.kind == ExportOptions::Kind::miv;
    const bool floats = options.depth != ExportOptions::Depth::png;
    const char* depthEnding = endingOf(options.depth);
    std::vector<std::string> own;
    for (std::size_t i = 0; i < names.size(); ++i) {
        const char* colourEnd = colourEnding(table.kindsOf(i).linear, options);
        if (miv) {
            own.push_back(fmt::format("{}_color{}", names[i], colourEnd));
            own.push_back(names[i] + (floats ? "_depth.exr" : "_depth16.png"));
        } else {
            own.push_back(fmt::format("images/{}{}", names[i], colourEnd));
            own.push_back(fmt::format("depth/{}{}", names[i], depthEnding));
        }
    }
    own.emplace_back(kEnvironmentFile);
    own.emplace_back(miv ? "cameras.json" : "transforms.json");
    STX_TRY(auto output, OutputFolder::create(folder, {options.noClobber}, own));
    const path& root = output.temporaryPath();
    if (!miv) STX_CHECK(makeImageFolders(root, folder));
    ColourLoss loss;
    const auto write = [&](std::size_t i,
                           const std::shared_ptr<const ReferenceView>& read) -> Result<void> {
        const ReferenceView& view = *read;
        loss.look(view, options);
        STX_CHECK(
            writeColour(view, root / (miv ? names[i] + "_color" : "images/" + names[i]), options));
        if (floats)
            return writeFloatDepth(
                view, root / (miv ? names[i] + "_depth.exr" : "depth/" + names[i] + depthEnding));
        if (!miv)
            return writeIntegerDepth(view, root / ("depth/" + names[i] + ".png"),
                                     [&](double d) { return d / head.unit; });
        STX_TRY(const MivRange range, mivRange(view));
        return writeIntegerDepth(view, root / (names[i] + "_depth16.png"),
                                 [&](double d) { return range.code(d); });
    };
    STX_CHECK(forEachView(table, peak::kExport, job, write));
    loss.note(job);
    if (bundle.environment)
        STX_CHECK(writeEnvironmentExr(*bundle.environment, root / kEnvironmentFile, job));
    STX_CHECK(writeFile(root / own.back(), std::as_bytes(std::span(text.data(), text.size()))));
    return output.commit();
}

}  // namespace stx
