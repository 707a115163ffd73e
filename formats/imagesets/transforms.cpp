// transforms.json of NeRF, instant-ngp, nerfstudio and Blender's exporters: camera-to-world
// matrices in our own axes, intrinsics for all frames or for each.

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "formats/files/messages.hpp"
#include "formats/imagesets/kinds.hpp"
#include "formats/imagesets/no_depth.hpp"
#include "formats/imagesets/poses.hpp"
#include "formats/imagesets/set_options.hpp"
#include "lib/base/parallel.hpp"

namespace stx::imagesets {
namespace {

/// The key of a frame, else of the file.
Result<std::optional<double>> find(const Json& file, const Json& frame, const char* key,
                                   const std::string& where) {
    STX_TRY(auto own, findNumber(frame, key, where));
    if (own) return own;
    return findNumber(file, key, where);
}

Result<std::string> cameraModel(const Json& file, const Json& frame, const std::string& where) {
    STX_TRY(auto model, findText(frame, "camera_model", where));
    if (!model) {
        STX_TRY(model, findText(file, "camera_model", where));
    }
    for (const Json* from : {&frame, &file})
        if (const auto it = from->find("is_fisheye"); it != from->end() && *it == Json(true))
            model = "OPENCV_FISHEYE";
    return model.value_or("OPENCV");
}

/// Whether a frame says something of its lens or its size itself; else it is as the file says.
bool hasOwnIntrinsics(const Json& frame) {
    constexpr std::string_view kKeys[] = {
        "camera_model",   "is_fisheye",     "w",  "h",  "fl_x", "fl_y", "cx", "cy",
        "camera_angle_x", "camera_angle_y", "k1", "k2", "k3",   "k4",   "p1", "p2"};
    for (auto it = frame.begin(); it != frame.end(); ++it)
        if (std::ranges::find(kKeys, it.key()) != std::end(kKeys)) return true;
    return false;
}

Result<void> setLens(const Json& file, const Json& frame, const std::string& where, bool fisheye,
                     Lens& lens) {
    const std::pair<const char*, double*> terms[] = {
        {"k1", &lens.k1}, {"k2", &lens.k2}, {"k3", &lens.k3}, {"p1", &lens.p1}, {"p2", &lens.p2}};
    for (const auto& [key, to] : terms) {
        STX_TRY(const auto value, find(file, frame, key, where));
        *to = value.value_or(0);
    }
    STX_TRY(const auto k4, find(file, frame, "k4", where));
    lens.fisheye = fisheye;
    if (fisheye)
        lens.k4 = k4.value_or(0);
    else if (k4.value_or(0) != 0)
        return failAt(where, ErrorCode::invalidInput,
                      "'k4' is {:g}; only k1 k2 k3 p1 p2 can be undone", *k4);
    return {};
}

/// Of one axis, 'x' or 'y'.
Result<Focal> focalOf(const Json& from, char axis, const std::string& where) {
    const std::string pixels = fmt::format("fl_{}", axis);
    const std::string angle = fmt::format("camera_angle_{}", axis);
    Focal out;
    STX_TRY(out.pixels, findNumber(from, pixels.c_str(), where));
    STX_TRY(out.angle, findNumber(from, angle.c_str(), where));
    if (out.pixels && !(*out.pixels > 0))
        return failAt(where, ErrorCode::invalidInput, "'{}' is {:g}; it must be above 0", pixels,
                      *out.pixels);
    if (out.angle && !(*out.angle > 0 && *out.angle < 3.14159))
        return failAt(where, ErrorCode::invalidInput,
                      "'{}' is {:g}; an angle between 0 and pi is expected", angle, *out.angle);
    return out;
}

Result<Pinhole> pinholeOf(const Json& file, const Json& frame, const std::string& where) {
    Pinhole out;
    STX_TRY(out.x, focalOf(frame, 'x', where));
    STX_TRY(out.y, focalOf(frame, 'y', where));
    STX_TRY(const Focal x, focalOf(file, 'x', where));
    STX_TRY(const Focal y, focalOf(file, 'y', where));
    // Where both say one along x, the file's along y is not of the frame's lens.
    if (!out.y.said() && !(out.x.said() && x.said())) out.y = y;
    if (!out.x.said()) out.x = x;
    STX_TRY(out.cx, find(file, frame, "cx", where));
    STX_TRY(out.cy, find(file, frame, "cy", where));
    if (!out.x.said())
        return failAt(where, ErrorCode::invalidInput,
                      "neither 'fl_x' nor 'camera_angle_x' is given");
    return out;
}

Result<void> setIntrinsics(const Json& file, const Json& frame, const std::string& where,
                           SetView& view) {
    STX_TRY(const std::string model, cameraModel(file, frame, where));
    const bool panorama = model == "EQUIRECTANGULAR";
    const bool orthographic = model == "ORTHOGRAPHIC";
    if (panorama)
        view.panorama = Panorama();
    else if (!orthographic && model != "OPENCV" && model != "PINHOLE" &&
             model != "SIMPLE_PINHOLE" && model != "SIMPLE_RADIAL" && model != "RADIAL" &&
             model != "OPENCV_FISHEYE")
        return failAt(where, ErrorCode::invalidInput,
                      "the camera_model is '{}'; OPENCV, OPENCV_FISHEYE, PINHOLE, SIMPLE_PINHOLE, "
                      "SIMPLE_RADIAL, RADIAL, ORTHOGRAPHIC and EQUIRECTANGULAR are known",
                      model);
    Camera& c = view.camera;
    c.orthographic = orthographic;
    STX_TRY(const auto w, find(file, frame, "w", where));
    STX_TRY(const auto h, find(file, frame, "h", where));
    if (w.has_value() != h.has_value())
        return failAt(where, ErrorCode::invalidInput, "'{}' is missing beside '{}'", w ? "h" : "w",
                      w ? "w" : "h");
    if (w) {
        STX_TRY(c.width, imageSide(*w, "w", 65535, where));
        STX_TRY(c.height, imageSide(*h, "h", 65535, where));
    }
    if (panorama) return {};
    STX_CHECK(setLens(file, frame, where, model == "OPENCV_FISHEYE", view.lens));
    STX_TRY(view.told, pinholeOf(file, frame, where));
    if (c.width == 0 && view.told.x.pixels) {
        // Old files leave out w and h where the principal point is the middle, or near it.
        const auto size = view.told.sizeAround();
        if (!size)
            return failAt(where, ErrorCode::invalidInput, "'w' and 'h' are missing beside 'fl_x'");
        view.sizeGuessed = true;
        c.width = size->x;
        c.height = size->y;
    }
    if (c.width > 0) view.told.fill(c);
    return {};
}

Result<void> setPose(const Json& frame, const std::string& where, SetView& view, Job& job) {
    STX_TRY(const glm::dmat4 m, needMatrix(frame, "transform_matrix", where));
    glm::dmat3 rotation(m);
    // Some exporters leave the scale of a parent in it; depth is not scaled by that.
    const double scale = std::cbrt(glm::determinant(rotation));
    if (scale > 1e-3 && std::abs(scale - 1) > 1e-3) {
        job.note(fmt::format("{}: the scale {:g} in 'transform_matrix' is left out", where, scale));
        rotation /= scale;
    }
    STX_TRY(const glm::dmat3 r, repairRotation(rotation, std::max(view.camera.fx, 1.0),
                                               where + ": 'transform_matrix'", job));
    view.camera.orientation = glm::normalize(glm::quat_cast(r));
    view.camera.position = glm::dvec3(m[3]);
    return {};
}

/// When, and by which camera: `time` in seconds, else `frame` by the file's `fps`; `camera`.
Result<void> setTime(const Json& file, const Json& frame, const std::string& where, SetView& view,
                     Job& job) {
    STX_TRY(view.time, findNumber(frame, "time", where));
    STX_TRY(const auto rate, findNumber(file, "fps", where));
    STX_TRY(const auto number, findNumber(frame, "frame", where));
    if (rate && !(*rate > 0))
        return failAt(where, ErrorCode::invalidInput, "'fps' is {:g}; it must be above 0", *rate);
    if (!view.time && number && rate) view.time = *number / *rate;
    if (!view.time && number && *number != 0 && !rate)
        job.note(
            "a frame has a number ('frame') without a clock ('fps'): all frames are taken as views "
            "of one moment; add \"fps\": N where they are a film");
    if (const auto it = frame.find("camera"); it != frame.end()) {
        if (it->is_string())
            view.taker = it->get<std::string>();
        else if (it->is_number_integer())
            view.taker = fmt::format("camera{}", it->get<std::int64_t>());
    }
    return {};
}

std::string nameOfFrame(const std::string& filePath) {
    return path(filePath).replace_extension().generic_string();
}

/// `depth_coding` of a file whose integers are not distances: normalised disparity between `near`
/// and `far`, with `none` (0) for what is unknown.
Result<std::optional<Distances>> codedDistances(const Json& file, const std::string& where) {
    const auto it = file.find("depth_coding");
    if (it == file.end()) return std::nullopt;
    const std::string place = where + ": 'depth_coding'";
    if (!it->is_object() || it->value("normalised_disparity", Json()) != Json(true))
        return failAt(place, ErrorCode::invalidInput,
                      "{{\"normalised_disparity\": true, \"near\": N, \"far\": F}} is expected; "
                      "leave it out where depth is a distance (integer_depth_scale)");
    STX_TRY(const auto nearest, findNumber(*it, "near", place));
    STX_TRY(const auto farthest, findNumber(*it, "far", place));
    STX_TRY(const auto none, findNumber(*it, "none", place));
    if (!nearest || !farthest || !(*nearest > 0 && *farthest > *nearest))
        return failAt(place, ErrorCode::invalidInput, "'near' and 'far' must be 0 < near < far");
    if (none.value_or(0) != 0)
        return failAt(place, ErrorCode::unsupported, "'none' is {:g}; only 0 is read", *none);
    return normalisedDisparity(*nearest, *farthest, none.has_value());
}

/// What a file says of the steps of its depth, in scene units.
struct DepthUnit {
    std::optional<double> named;     ///< of integers
    std::optional<double> ofArrays;  ///< what arrays of floats are multiplied by
    double usual = kMillimetre;      ///< of integers, where it names none
    double applied = 1;              ///< what of these is its applied_scale
};

/// nerfstudio counts poses that were scaled before (applied_scale), and multiplies depth as it was
/// stored, arrays of floats too, by depth_unit_scale_factor and by that
/// (get_depth_image_from_path() with the scale of its dataparser). integer_depth_scale is in units
/// of the poses.
Result<DepthUnit> depthUnitOf(const Json& file, const std::string& where) {
    DepthUnit out;
    STX_TRY(out.named, within(where, findNumber(file, "integer_depth_scale", "")));
    STX_TRY(const auto factor, within(where, findNumber(file, "depth_unit_scale_factor", "")));
    STX_TRY(const auto applied, within(where, findNumber(file, "applied_scale", "")));
    for (const auto& scale : {out.named, factor})
        if (scale && !(*scale > 0))
            return failAt(where, ErrorCode::invalidInput,
                          "the depth's scale is {:g}; it must be above 0", *scale);
    if (applied && !(*applied > 0))
        return failAt(where, ErrorCode::invalidInput, "'applied_scale' is {:g}; it must be above 0",
                      *applied);
    if (out.named) return out;
    out.applied = applied.value_or(1.0);
    out.usual *= out.applied;
    if (factor) out.named = out.ofArrays = *factor * out.applied;
    return out;
}

/// Of `others`, with a note about what an applied_scale did to integers.
Distances notedScale(Distances others, double applied, const std::string& where) {
    return [others = std::move(others), applied, where](Image<float>& values, const Camera& camera,
                                                        int largest, Job& job) -> Result<void> {
        if (largest > 0)
            job.noteOnce(
                fmt::format("{}: depth is taken times {:g}, its applied_scale, as its "
                            "poses are; --depth-unit is in place of that",
                            where, applied));
        return others(values, camera, largest, job);
    };
}

/// Of arrays: those of floats are multiplied by `unit`.
Distances arraysInUnits(Distances others, double unit, const std::string& where) {
    return [others = std::move(others), unit, where](Image<float>& values, const Camera& camera,
                                                     int largest, Job& job) -> Result<void> {
        STX_CHECK(others(values, camera, largest, job));
        if (largest > 0) return {};
        job.noteOnce(
            fmt::format("{}: arrays of depth are taken times {:g}, as its "
                        "depth_unit_scale_factor says; leave it out where they are in "
                        "scene units",
                        where, unit));
        for (float& v : values.pixels())
            if (v < kDistanceOfNothing) v = static_cast<float>(v * unit);
        return {};
    };
}

}  // namespace

Result<std::optional<Distances>> transformsDistances(const Json& file, const std::string& where) {
    STX_TRY(const auto coded, codedDistances(file, where));
    if (coded) return coded;
    STX_TRY(const auto unit, depthUnitOf(file, where));
    if (!unit.named) return std::nullopt;
    return scaledIntegers(*unit.named);
}

Result<std::vector<SetView>> transformsViews(const Json& file, Job& job) {
    const Json& frames = file["frames"];
    STX_CHECK(checkViewCount(frames.size(), job.limits, "'frames'"));
    std::vector<SetView> views;
    views.reserve(frames.size());
    std::optional<SetView> common;  ///< what the file says for all
    for (std::size_t i = 0; i < frames.size(); ++i) {
        const std::string where = fmt::format("frames[{}]", i);
        const Json& frame = frames[i];
        if (!frame.is_object())
            return failAt(where, ErrorCode::invalidInput, "an object is expected");
        SetView view;
        if (hasOwnIntrinsics(frame)) {
            STX_CHECK(setIntrinsics(file, frame, where, view));
        } else {
            // Sets have tens of thousands of such frames.
            if (!common) STX_CHECK(setIntrinsics(file, frame, where, common.emplace()));
            view = *common;
        }
        STX_TRY(const auto name, findText(frame, "file_path", where));
        view.name = name ? nameOfFrame(*name) : fmt::format("frame{:03}", i);
        STX_CHECK(setPose(frame, where, view, job));
        STX_CHECK(readOwnKeys(frame, where, view));
        STX_CHECK(setTime(file, frame, where, view, job));
        if (!view.exactName.empty()) view.name = view.exactName;
        if (view.camera.width > 0)
            if (auto ok = view.camera.check(); !ok) return tl::unexpected(ok.error().at(where));
        views.push_back(std::move(view));
    }
    return views;
}

Result<SetDescription> describeTransforms(const path& given, const ImageSetOptions& options,
                                          Job& job) {
    std::error_code ec;
    const path file = std::filesystem::is_directory(given, ec) ? given / "transforms.json" : given;
    const path folder = folderOf(file);
    const std::string where = inQuotes(file.string());
    STX_TRY(const Json json, readJson(file, job.limits));
    if (jsonKindOf(json) != JsonKind::transforms)
        return failAt(where, ErrorCode::invalidInput,
                      "a list 'frames' is expected in it, as in a transforms.json; name another "
                      "kind with --from");
    SetDescription set;
    STX_TRY(set.views, within(where, transformsViews(json, job)));
    STX_TRY(const auto title, within(where, findText(json, "stx:title", "")));
    set.title = title.value_or("");
    STX_TRY(set.origin, originOf(json, where));
    STX_TRY(set.end, within(where, findNumber(json, "stx:end", "")));
    STX_TRY(set.environment, environmentOf(json, folder, where, job.limits));
    STX_TRY(const DepthUnit unit, depthUnitOf(json, where));
    STX_TRY(const auto coded, codedDistances(json, where));
    if (coded && options.depthUnit > 0)
        return failAt(where, ErrorCode::usage,
                      "its depth is not in steps of a distance, as 'depth_coding' says; leave out "
                      "--depth-unit");
    Distances distances = coded ? *coded : integersOrFloats(options, unit.named, unit.usual);
    if (!coded && unit.applied != 1 && options.depthUnit == 0)
        distances = notedScale(std::move(distances), unit.applied, where);
    const Distances ofArrays = !coded && unit.ofArrays.value_or(1) != 1
                                   ? arraysInUnits(distances, *unit.ofArrays, where)
                                   : distances;
    const Json& frames = json["frames"];
    const auto describe = [&](std::size_t i) -> Result<void> {
        SetView& view = set.views[i];
        const std::string place = fmt::format("{}: frames[{}]", where, i);
        STX_TRY(const std::string texture, needText(frames[i], "file_path", place));
        const std::string textureFile = withImageEnding(folder, texture);
        STX_TRY(auto depth, findText(frames[i], "depth_file_path", place));
        if (!depth) {
            STX_TRY(depth, findText(frames[i], "depth_path", place));
        }
        if (!depth && path(textureFile).extension() == ".exr") depth = textureFile;
        if (!depth) {
            view.missing = failAt(place, ErrorCode::invalidInput,
                                  "'depth_file_path' is missing; each frame needs its depth")
                               .value();
            STX_TRY(view.texture, sourceInside(folder, textureFile, place, job.limits));
            return {};
        }
        STX_CHECK(findPictures(folder, textureFile, withImageEnding(folder, *depth), place,
                               job.limits, view));
        STX_TRY(const auto mask, findText(frames[i], "mask_path", place));
        if (mask) {
            STX_TRY(view.mask, sourceInside(folder, *mask, place, job.limits));
            if (!view.missing) view.missing = view.mask.missing;
        }
        const auto ending = path(*depth).extension();
        view.distances = ending == ".npy" || ending == ".npz" ? ofArrays : distances;
        return {};
    };
    // Long films have tens of thousands of files to look for.
    std::vector<Result<void>> done(set.views.size());
    parallelFor(0, static_cast<std::int64_t>(done.size()), [&](std::int64_t i) {
        const auto k = static_cast<std::size_t>(i);
        done[k] = describe(k);
    });
    for (const auto& one : done) STX_CHECK(one);
    return set;
}

}  // namespace stx::imagesets
