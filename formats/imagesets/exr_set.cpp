// OpenEXR pictures with a channel Z, as renderers write them: one part or several, one view or
// more. Cameras are in the standard attributes or in a JSON file beside the picture.

#include <algorithm>
#include <cmath>
#include <map>

#include "formats/exr/bundle_exr.hpp"
#include "formats/exr/exr_file.hpp"
#include "formats/files/messages.hpp"
#include "formats/imagesets/kinds.hpp"

namespace stx::imagesets {
namespace {

/// Where the channels of one view are: a part, and the prefix of their names.
struct Layer {
    int part = -1;
    std::string prefix;
};

struct ExrView {
    std::string name;
    Layer colour, depth;
};

/// `left` of a channel `left.Z`.
std::string prefixOf(const std::string& channel) {
    const auto dot = channel.rfind('.');
    return dot == std::string::npos ? "" : channel.substr(0, dot + 1);
}

/// Views by the attribute `view`, else by what is before the last dot of a part's or a
/// channel's name.
std::map<std::string, ExrView> viewsOf(const ExrReader& reader) {
    std::map<std::string, ExrView> views;
    const auto& parts = reader.parts();
    for (std::size_t i = 0; i < parts.size(); ++i) {
        const ExrPart& part = parts[i];
        for (const ExrChannel& channel : part.channels) {
            const std::string prefix = prefixOf(channel.name);
            const std::string leaf = channel.name.substr(prefix.size());
            // N.Y and N.Z beside N.X are coordinates.
            if (part.channel(prefix + "X")) continue;
            std::string name = part.view;
            if (name.empty() && !prefix.empty()) name = prefix.substr(0, prefix.size() - 1);
            if (name.empty() && parts.size() > 1) {
                const std::string before = prefixOf(part.name);
                if (!before.empty()) name = before.substr(0, before.size() - 1);
            }
            const bool isDepth = leaf == "Z";
            const bool isColour = leaf == "R" || leaf == "Y";
            if (!isDepth && !isColour) continue;
            ExrView& view = views[name];
            view.name = name;
            Layer& layer = isDepth ? view.depth : view.colour;
            // What is in no layer is the view's own: Albedo.R comes before R.
            if (layer.part < 0 || prefix.size() < layer.prefix.size())
                layer = {static_cast<int>(i), prefix};
        }
    }
    std::erase_if(
        views, [](const auto& v) { return v.second.colour.part < 0 || v.second.depth.part < 0; });
    return views;
}

/// Colour and depth on the depth's data window.
Result<StoredView> loadView(const path& file, const ExrView& view, Job& job) {
    STX_TRY(const auto reader, ExrReader::open(file, job.limits));
    const ExrPart& depthPart = reader.parts()[static_cast<std::size_t>(view.depth.part)];
    const ExrPart& colourPart = reader.parts()[static_cast<std::size_t>(view.colour.part)];
    STX_CHECK(reader.checkPlausible(view.depth.part));
    STX_CHECK(reader.checkPlausible(view.colour.part));
    const auto pixels = static_cast<std::uint64_t>(depthPart.width) * depthPart.height +
                        static_cast<std::uint64_t>(colourPart.width) * colourPart.height;
    STX_CHECK(within(reader.where(), job.limits.checkAllocation(pixels, 36, "a view")));
    StoredView stored;
    stored.depth = Image<float>(depthPart.width, depthPart.height);
    STX_CHECK(
        reader.readPart(view.depth.part, {{view.depth.prefix + "Z", stored.depth.data(), 1}}));
    RgbaFloatImage colour(colourPart.width, colourPart.height);
    float* at = &colour.data()->x;
    const std::string& p = view.colour.prefix;
    const bool grey = !colourPart.channel(p + "R");
    const bool alpha = colourPart.channel(p + "A") != nullptr;
    std::vector<ExrPixels> channels;
    if (grey) {
        channels = {{p + "Y", at, 4}};
    } else {
        channels = {{p + "R", at, 4}, {p + "G", at + 1, 4}, {p + "B", at + 2, 4}};
    }
    if (alpha) channels.push_back({p + "A", at + 3, 4});
    STX_CHECK(reader.readPart(view.colour.part, channels));
    if (!colourPart.primariesNote.empty())
        job.note(reader.where() + ": " + colourPart.primariesNote);
    RgbaFloatImage placed(depthPart.width, depthPart.height);
    const int dx = depthPart.originX - colourPart.originX;
    const int dy = depthPart.originY - colourPart.originY;
    for (int y = 0; y < placed.height(); ++y) {
        for (int x = 0; x < placed.width(); ++x) {
            const int cx = x + dx, cy = y + dy;
            if (!colour.contains(cx, cy)) continue;
            glm::vec4 c = colour.at(cx, cy);
            if (grey) c = glm::vec4(c.x, c.x, c.x, c.w);
            if (!grey && colourPart.rec709FromRgb)
                c = glm::vec4(glm::mat3(*colourPart.rec709FromRgb) * glm::vec3(c), c.w);
            if (!std::isfinite(c.x + c.y + c.z + c.w))
                return failAt(reader.where(), ErrorCode::invalidInput,
                              "view '{}': a colour at column {}, row {} is not finite", view.name,
                              cx, cy);
            const float a = alpha ? std::clamp(c.w, 0.0f, 1.0f) : 1.0f;
            if (alpha && a > 0) c /= a;
            placed.at(x, y) = glm::vec4(glm::vec3(c), a);
        }
    }
    stored.alpha = true;  // outside the colour's data window there is none
    stored.texture = std::move(placed);
    return stored;
}

/// The camera on the depth's data window, from one that sees the display window.
Camera shifted(Camera camera, const ExrPart& depth) {
    camera.cx -= depth.originX;
    camera.cy -= depth.originY;
    camera.width = depth.width;
    camera.height = depth.height;
    return camera;
}

/// In the world.
Result<Camera> cameraOf(const ExrReader& reader, const ExrView& view,
                        const std::vector<NamedCamera>& beside, const std::string& stem,
                        std::size_t index, std::size_t count) {
    const ExrPart& depth = reader.parts()[static_cast<std::size_t>(view.depth.part)];
    const ExrPart& colour = reader.parts()[static_cast<std::size_t>(view.colour.part)];
    for (const ExrPart* part : {&depth, &colour}) {
        if (!part->attribute<glm::dmat4>("worldToCamera") &&
            !part->attribute<glm::dvec3>("stx:position"))
            continue;
        STX_TRY(const ReferenceView known, within(reader.where(), exrCamera(*part)));
        Camera c = known.camera;
        c.position += exrOrigin(reader);
        c.cx += part->originX;
        c.cy += part->originY;
        return shifted(c, depth);
    }
    const NamedCamera* found = nullptr;
    for (const NamedCamera& c : beside)
        if (c.name == view.name) found = &c;
    if (!found && beside.size() == count) found = &beside[index];
    if (!found)
        return failAt(
            reader.where(), ErrorCode::invalidInput,
            "view '{}' has no camera: neither the attribute worldToCamera nor a camera of "
            "that name in a JSON file beside it ({}.json, cameras.json, transforms.json)",
            view.name, stem);
    if (found->camera.width != depth.displayWidth || found->camera.height != depth.displayHeight)
        return failAt(reader.where(), ErrorCode::invalidInput,
                      "view '{}' is {}x{} (display window) but its camera has {}x{} pixels",
                      view.name, depth.displayWidth, depth.displayHeight, found->camera.width,
                      found->camera.height);
    return shifted(found->camera, depth);
}

}  // namespace

Result<SetDescription> describeExr(const path& given, const ImageSetOptions&, Job& job) {
    std::vector<path> files;
    std::error_code ec;
    const bool isFolder = std::filesystem::is_directory(given, ec);
    if (isFolder) {
        for (const std::string& name : filesIn(given))
            if (path(name).extension() == ".exr") files.push_back(given / name);
    } else {
        files.push_back(given);
    }
    const path folder = isFolder ? given : folderOf(given);
    const std::string where = inQuotes(given.string());
    if (files.empty())
        return failAt(
            where, ErrorCode::io,
            "no .exr file was found in it; each view is one, with colour and a channel Z");
    STX_CHECK(checkViewCount(files.size(), job.limits, where));

    struct Found {
        path file;
        ExrView view;
    };
    std::vector<Found> all;
    for (const path& file : files) {
        STX_TRY(const auto reader, ExrReader::open(file, job.limits));
        for (auto& [name, view] : viewsOf(reader)) {
            ExrView own = view;
            const std::string stem = file.stem().string();
            own.name = name.empty()       ? stem
                       : files.size() > 1 ? fmt::format("{}_{}", stem, name)
                                          : name;
            all.push_back({file, std::move(own)});
        }
    }
    if (all.empty())
        return failAt(where, ErrorCode::invalidInput,
                      "no view in it has both colour (R G B or Y) and a channel Z; render with a "
                      "depth or Z pass");
    STX_CHECK(checkViewCount(all.size(), job.limits, where));
    const std::string json = firstThere(
        folder, {files.front().stem().string() + ".json", "cameras.json", "transforms.json"});
    std::vector<NamedCamera> beside;
    if (!json.empty()) {
        STX_TRY(beside, readCameraFile(folder / json, job));
    }
    SetDescription set;
    for (std::size_t i = 0; i < all.size(); ++i) {
        STX_TRY(const auto reader, ExrReader::open(all[i].file, job.limits));
        SetView view;
        view.name = all[i].view.name;
        view.texture.name = view.depth.name = all[i].file.filename().string();
        view.texture.path = view.depth.path = all[i].file;
        STX_TRY(view.camera,
                cameraOf(reader, all[i].view, beside, all[i].file.stem().string(), i, all.size()));
        if (const glm::dvec3 origin = exrOrigin(reader); !set.origin && origin != glm::dvec3(0.0))
            set.origin = origin;
        view.load = [found = all[i]](const SetView&, Job& inner) {
            return loadView(found.file, found.view, inner);
        };
        set.views.push_back(std::move(view));
    }
    return set;
}

}  // namespace stx::imagesets
