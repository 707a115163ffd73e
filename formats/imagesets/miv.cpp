// The camera lists of MPEG's immersive video test material (TMIV) and of RVS. Axes: x forward, y
// left, z up; rotation R = Rz(yaw) Ry(pitch) Rx(roll), degrees, camera to world.

#include <cmath>
#include <set>

#include <glm/gtc/constants.hpp>

#include "formats/files/messages.hpp"
#include "formats/imagesets/kinds.hpp"
#include "formats/imagesets/patterns.hpp"

namespace stx::imagesets {
namespace {

constexpr double kRadian = glm::pi<double>() / 180.0;
/// A far distance of this or more means infinity.
constexpr double kInfinity = 1000;
constexpr double kEndless = std::numeric_limits<double>::infinity();

struct MivDepth {
    double nearest = 0, farthest = 0;
    bool invalidZero = false;  ///< code 0 means "no depth"
};

Result<MivDepth> depthOf(const Json& camera, const std::string& where) {
    MivDepth d;
    STX_TRY(const auto range, needNumbers(camera, "Depth_range", 2, where));
    d.nearest = range[0];
    d.farthest = range[1];
    if (!(d.nearest > 0 && d.nearest < d.farthest))
        return failAt(where, ErrorCode::invalidInput,
                      "'Depth_range' is {:g} to {:g}; near must be above 0 and below far",
                      d.nearest, d.farthest);
    if (const auto it = camera.find("HasInvalidDepth"); it != camera.end()) {
        if (!it->is_boolean())
            return failAt(where, ErrorCode::invalidInput,
                          "'HasInvalidDepth' must be true or false");
        d.invalidZero = it->get<bool>();
    }
    return d;
}

Distances distancesOf(const MivDepth& range) {
    return normalisedDisparity(
        range.nearest, range.farthest >= kInfinity ? kEndless : range.farthest, range.invalidZero);
}

Result<void> setProjection(const Json& c, const std::string& where, SetView& view) {
    STX_TRY(const auto resolution, needNumbers(c, "Resolution", 2, where));
    Camera& camera = view.camera;
    STX_TRY(camera.width, imageSide(resolution[0], "Resolution", 65535, where));
    STX_TRY(camera.height, imageSide(resolution[1], "Resolution", 65535, where));
    camera.cx = camera.width * 0.5;
    camera.cy = camera.height * 0.5;
    STX_TRY(const std::string projection, needText(c, "Projection", where));
    if (projection == "Perspective") {
        STX_TRY(const auto focal, needNumbers(c, "Focal", 2, where));
        if (!(focal[0] > 0 && focal[1] > 0))
            return failAt(where, ErrorCode::invalidInput,
                          "'Focal' is {:g}, {:g}; both must be above 0", focal[0], focal[1]);
        // MPEG's own spelling, and the one of those who correct it.
        STX_TRY(auto principal, findNumbers(c, "Principle_point", 2, where));
        if (!principal) {
            STX_TRY(principal, findNumbers(c, "Principal_point", 2, where));
        }
        if (!principal)
            return failAt(where, ErrorCode::invalidInput, "'Principle_point' is missing");
        camera.fx = focal[0];
        camera.fy = focal[1];
        camera.cx = (*principal)[0];
        camera.cy = (*principal)[1];
        return {};
    }
    if (projection != "Equirectangular" && projection != "Orthographic")
        return failAt(where, ErrorCode::invalidInput,
                      "'Projection' is '{}'; Perspective, Orthographic and Equirectangular are "
                      "known",
                      projection);
    STX_TRY(const auto horizontal, needNumbers(c, "Hor_range", 2, where));
    STX_TRY(const auto vertical, needNumbers(c, "Ver_range", 2, where));
    if (!(horizontal[0] < horizontal[1] && vertical[0] < vertical[1]))
        return failAt(where, ErrorCode::invalidInput,
                      "'Hor_range' and 'Ver_range' are {:g} to {:g} and {:g} to {:g}; both must "
                      "rise",
                      horizontal[0], horizontal[1], vertical[0], vertical[1]);
    if (projection == "Orthographic") {
        // The window in scene units, along y (left) and z (up).
        camera.orthographic = true;
        camera.fx = camera.width / (horizontal[1] - horizontal[0]);
        camera.fy = camera.height / (vertical[1] - vertical[0]);
        camera.cx = horizontal[1] * camera.fx;
        camera.cy = vertical[1] * camera.fy;
        return {};
    }
    if (horizontal[1] - horizontal[0] > 360.0001 || vertical[0] < -90.0001 ||
        vertical[1] > 90.0001 || std::abs(horizontal[0]) > 360 || std::abs(horizontal[1]) > 360)
        return failAt(where, ErrorCode::invalidInput,
                      "'Hor_range' may span 360 degrees and 'Ver_range' -90 to 90; found {:g} to "
                      "{:g} and {:g} to {:g}",
                      horizontal[0], horizontal[1], vertical[0], vertical[1]);
    view.panorama = Panorama{horizontal[1] * kRadian, horizontal[0] * kRadian,
                             vertical[1] * kRadian, vertical[0] * kRadian};
    return {};
}

Result<SetView> viewOf(const Json& c, const std::string& where) {
    SetView view;
    STX_TRY(view.name, needText(c, "Name", where));
    STX_TRY(const auto p, needNumbers(c, "Position", 3, where));
    STX_TRY(const auto r, needNumbers(c, "Rotation", 3, where));
    view.camera.position = {-p[1], p[2], -p[0]};
    view.camera.orientation = glm::normalize(quatFromAxisAngle({0, 1, 0, r[0] * kRadian}) *
                                             quatFromAxisAngle({1, 0, 0, -r[1] * kRadian}) *
                                             quatFromAxisAngle({0, 0, 1, -r[2] * kRadian}));
    STX_CHECK(setProjection(c, where, view));
    STX_CHECK(readOwnKeys(c, where, view));
    if (auto ok = view.camera.check(); !ok) return tl::unexpected(ok.error().at(where));
    return view;
}

struct Search {
    const path& folder;
    const Json& camera;  ///< of the JSON
    const SetView& view;
    int frame;
    const char* bitsKey;  ///< of the stored values, when a file's name does not say
    const char* spaceKey;
};

const std::vector<std::string>& formatNames() {
    static const std::vector<std::string> names = [] {
        std::vector<std::string> all;
        for (const char* planes : {"yuv420p", "yuv400p", "gray", "yuv422p", "yuv444p"}) {
            all.emplace_back(planes);
            for (const int bits : {10, 12, 14, 16})
                all.push_back(fmt::format("{}{}le", planes, bits));
        }
        return all;
    }();
    return names;
}

/// The layout by a name's last part (`..._yuv420p10le.yuv`), else the JSON's.
Result<YuvFormat> formatOf(const std::string& name, const Search& search) {
    const std::string stem = path(name).stem().string();
    std::optional<YuvFormat> format;
    if (const auto at = stem.find_last_of("_-."); at != std::string::npos)
        format = yuvFormatNamed(std::string_view(stem).substr(at + 1));
    if (!format) {
        STX_TRY(const double bits, needNumber(search.camera, search.bitsKey, ""));
        STX_TRY(const auto space, findText(search.camera, search.spaceKey, ""));
        const std::string planes = space == "YUV400"   ? "yuv400p"
                                   : space == "YUV444" ? "yuv444p"
                                   : space == "YUV422" ? "yuv422p"
                                                       : "yuv420p";
        if (bits >= 8 && bits <= 16)
            format = yuvFormatNamed(bits == 8 ? planes : fmt::format("{}{:g}le", planes, bits));
        if (!format)
            return fail(ErrorCode::invalidInput, "'{}' is {:g}; 8 to 16 is possible",
                        search.bitsKey, bits);
    }
    format->width = search.view.camera.width;
    format->height = search.view.camera.height;
    return *format;
}

/// The first file that one of the patterns names; empty when there is none.
std::string findFile(const Search& search, const std::vector<std::string>& patterns) {
    const Placeholders p{search.view.name, search.view.camera.width, search.view.camera.height,
                         search.frame};
    std::vector<std::string> names;
    for (const std::string& pattern : patterns) {
        const std::string name = filled(pattern, p);
        const auto at = name.find("{format}");
        if (at == std::string::npos) {
            names.push_back(name);
            continue;
        }
        for (const std::string& format : formatNames()) {
            std::string each = name;
            names.push_back(each.replace(at, 8, format));
        }
    }
    return firstThere(search.folder, names);
}

std::vector<std::string> texturePatterns() {
    return {"{name}_color.png",
            "{name}_texture.png",
            "{name}_colour.png",
            "{name}.png",
            "{name}_color.exr",
            "{name}_texture.exr",
            "{name}_color.jpg",
            "{name}_texture.jpg",
            "{name}.jpg",
            "{name}_texture_{w}x{h}_{format}.yuv",
            "{name}_color_{w}x{h}_{format}.yuv",
            "{name}_tex_{w}x{h}_{format}.yuv",
            "{name}_{w}x{h}_{format}.yuv",
            "{name}_texture.yuv",
            "{name}.yuv"};
}
std::vector<std::string> depthPatterns() {
    return {"{name}_depth.exr",
            "{name}_depth16.png",
            "{name}_depth.png",
            "{name}_geometry.png",
            "{name}_depth8.png",
            "{name}_depth_{w}x{h}_{format}.yuv",
            "{name}_geometry_{w}x{h}_{format}.yuv",
            "{name}_depth.yuv"};
}

/// A file for each frame.
bool isNumbered(const std::string& pattern) {
    return pattern.find("{frame") != std::string::npos;
}

/// Resolves a file and finds out its planes and frame. Sets `frames` to the most of all: where a
/// file has fewer, frames are missing.
Result<PictureSource> sourceOf(const std::string& name, const Search& search, bool numbered,
                               int& frames, const Limits& limits) {
    STX_TRY(auto source, sourceInside(search.folder, name, "", limits));
    if (source.path.extension() == ".yuv") {
        STX_TRY(source.yuv, formatOf(name, search));
        STX_TRY(const int count, yuvFrameCount(source.path, *source.yuv));
        if (numbered) return source;
        source.frame = search.frame;
        frames = std::max(frames, count);
    }
    return source;
}

}  // namespace

Result<Distances> mivDistances(const Json& camera, const std::string& where) {
    STX_TRY(const MivDepth range, depthOf(camera, where));
    return distancesOf(range);
}

Result<std::vector<SetView>> mivViews(const Json& file, Job& job) {
    const Json& cameras = file["cameras"];
    STX_CHECK(checkViewCount(cameras.size(), job.limits, "'cameras'"));
    std::vector<SetView> views;
    std::set<std::string> names;
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        const std::string where = fmt::format("cameras[{}]", i);
        if (!cameras[i].is_object())
            return failAt(where, ErrorCode::invalidInput, "an object is expected");
        STX_TRY(auto view, viewOf(cameras[i], where));
        if (!names.insert(view.name).second)
            return failAt(where, ErrorCode::invalidInput, "the name '{}' is there twice",
                          view.name);
        views.push_back(std::move(view));
    }
    return views;
}

namespace {

/// The camera list that was given, or that of a folder.
Result<path> cameraListIn(const path& given, Job& job) {
    std::error_code ec;
    if (!std::filesystem::is_directory(given, ec)) return given;
    path file;
    for (const std::string& name : filesIn(given)) {
        if (path(name).extension() != ".json") continue;
        const auto json = readJson(given / name, job.limits);
        if (!json || jsonKindOf(*json) != JsonKind::miv) continue;
        if (!file.empty())
            return failAt(inQuotes(given.string()), ErrorCode::invalidInput,
                          "there are two camera lists, '{}' and '{}'; give the file",
                          file.filename().string(), name);
        file = given / name;
    }
    if (file.empty())
        return failAt(inQuotes(given.string()), ErrorCode::invalidInput,
                      "no .json file in it has a list 'cameras' with MIV's keys (Projection, "
                      "Position); give the file, or name another kind with --from");
    return file;
}

/// The names of sourceCameraNames; none = all.
Result<std::set<std::string>> sourceNames(const Json& json, const std::vector<SetView>& all,
                                          const std::string& where) {
    std::set<std::string> sources;
    if (const auto it = json.find("sourceCameraNames"); it != json.end() && it->is_array()) {
        for (const Json& name : *it)
            if (name.is_string()) sources.insert(name.get<std::string>());
        for (const std::string& name : sources)
            if (std::none_of(all.begin(), all.end(), [&](const auto& v) { return v.name == name; }))
                return failAt(where, ErrorCode::invalidInput,
                              "sourceCameraNames names '{}', which no camera in the list has",
                              name);
    }
    return sources;
}

/// Says in a view which of its pictures are not there.
void noteMissing(SetView& view, int frame, const std::vector<std::string>& textures,
                 const std::vector<std::string>& depths, const std::string& place) {
    const Placeholders p{view.name, view.camera.width, view.camera.height, frame};
    const auto miss = [&](PictureSource& source, const char* what, const auto& names) {
        if (!source.name.empty()) return;
        source.name = filled(names.front(), p);
        source.missing =
            Error{ErrorCode::io,
                  fmt::format("there is no {} image; looked for '{}'{}", what, source.name,
                              names.size() > 1 ? " and the other usual names" : ""),
                  place};
    };
    miss(view.texture, "texture", textures);
    miss(view.depth, "depth", depths);
}

/// Finds the pictures of the cameras of a list.
class MivPictures {
  public:
    /// `areSources`: the list says which of its cameras have pictures.
    MivPictures(const path& folder, const ImageSetOptions& options, bool areSources,
                const Limits& limits)
        : folder_(folder), options_(options), areSources_(areSources), limits_(limits) {}
    /// False: the camera has none, and need not have any.
    Result<bool> find(const Json& camera, const std::string& place, SetView& view);
    [[nodiscard]] int frames() const { return frames_; }

  private:
    const path& folder_;
    const ImageSetOptions& options_;
    bool areSources_;
    const Limits& limits_;
    int frames_ = 0;
    bool counted_ = false;  ///< files with numbers, by those of the first camera that is there
};

Result<bool> MivPictures::find(const Json& camera, const std::string& place, SetView& view) {
    const int frame = options_.frame;
    const Search forTexture{folder_, camera, view, frame, "BitDepthColor", "ColorSpace"};
    const Search forDepth{folder_, camera, view, frame, "BitDepthDepth", "DepthColorSpace"};
    const auto patterns = [](const std::string& own, std::vector<std::string> usual) {
        return own.empty() ? std::move(usual) : std::vector<std::string>{own};
    };
    const auto textures = patterns(options_.texturePattern, texturePatterns());
    const auto depths = patterns(options_.depthPattern, depthPatterns());
    const std::string texture = findFile(forTexture, textures);
    const std::string depth = findFile(forDepth, depths);
    if (texture.empty() || depth.empty()) {
        // A list of the sources is a promise; else cameras without images are viewports.
        if (!areSources_ && options_.texturePattern.empty() && options_.depthPattern.empty())
            return false;
        view.texture.name = texture;
        view.depth.name = depth;
        noteMissing(view, frame, textures, depths, place);
        return true;
    }
    STX_TRY(const MivDepth range, depthOf(camera, place));
    const bool numbersTextures = isNumbered(options_.texturePattern),
               numbersDepths = isNumbered(options_.depthPattern);
    STX_TRY(view.texture,
            within(place, sourceOf(texture, forTexture, numbersTextures, frames_, limits_)));
    STX_TRY(view.depth, within(place, sourceOf(depth, forDepth, numbersDepths, frames_, limits_)));
    view.distances = distancesOf(range);
    if (!counted_ && (numbersTextures || numbersDepths)) {
        const auto there = [&](int number) {
            Search nextTexture = forTexture, nextDepth = forDepth;
            nextTexture.frame = nextDepth.frame = number;
            return !findFile(nextTexture, textures).empty() && !findFile(nextDepth, depths).empty();
        };
        const auto& numbered = numbersDepths ? depth : texture;
        frames_ = std::max(frames_, 1 + lastFrame(folder_, folder_ / numbered, frame, there));
        counted_ = true;
    }
    return true;
}

}  // namespace

Result<SetDescription> describeMiv(const path& given, const ImageSetOptions& options, Job& job) {
    STX_TRY(const path file, cameraListIn(given, job));
    const path folder = folderOf(file);
    const std::string where = inQuotes(file.string());
    STX_TRY(const Json json, readJson(file, job.limits));
    if (jsonKindOf(json) != JsonKind::miv)
        return failAt(where, ErrorCode::invalidInput,
                      "a list 'cameras' with MIV's keys (Projection, Position) is expected in it; "
                      "name another kind with --from");
    STX_TRY(auto all, within(where, mivViews(json, job)));

    STX_TRY(const auto sources, sourceNames(json, all, where));
    SetDescription set;
    STX_TRY(const auto title, within(where, findText(json, "Content_name", "")));
    set.title = title.value_or("");
    STX_TRY(set.origin, originOf(json, where));
    STX_TRY(set.environment, environmentOf(json, folder, where, job.limits));
    MivPictures pictures(folder, options, !sources.empty(), job.limits);
    for (std::size_t i = 0; i < all.size(); ++i) {
        SetView& view = all[i];
        if (!sources.empty() && !sources.contains(view.name)) continue;
        const std::string place = fmt::format("{}: camera '{}'", where, view.name);
        STX_TRY(const bool isThere, pictures.find(json["cameras"][i], place, view));
        if (!isThere) continue;
        if (!view.exactName.empty()) view.name = view.exactName;
        set.views.push_back(std::move(view));
    }
    if (set.views.empty())
        return failAt(where, ErrorCode::invalidInput,
                      "no camera has both a texture and a depth image beside the file (such as "
                      "NAME_color.png and NAME_depth16.png, or NAME_texture_WxH_FORMAT.yuv)");
    if (options.yuv != YuvColour() &&
        std::ranges::none_of(set.views, [](const SetView& v) { return v.texture.yuv.has_value(); }))
        job.noteUnused({"--yuv"}, "of MIV sets with .yuv files",
                       fmt::format("the pictures of {} are of other kinds", where));
    set.frames = std::max(pictures.frames(), 1);
    STX_TRY(const auto rate, within(where, findNumber(json, "Fps", "")));
    if (rate && !(*rate > 0))
        return failAt(where, ErrorCode::invalidInput, "'Fps' is {:g}; it must be above 0", *rate);
    set.rate = rate.value_or(set.rate);
    return set;
}

}  // namespace stx::imagesets
