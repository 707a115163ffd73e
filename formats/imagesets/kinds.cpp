#include "formats/imagesets/kinds.hpp"

#include <algorithm>
#include <cmath>

#include "formats/files/messages.hpp"
#include "formats/files/named_files.hpp"

namespace stx::imagesets {

JsonKind jsonKindOf(const Json& file) {
    if (!file.is_object()) return JsonKind::none;
    const auto list = [&](const char* key) {
        const auto it = file.find(key);
        return it != file.end() && it->is_array() ? &*it : nullptr;
    };
    if (list("frames")) return JsonKind::transforms;
    if (list("camera_path")) return JsonKind::cameraPath;
    const Json* cameras = list("cameras");
    if (!cameras) return JsonKind::none;
    for (const Json& camera : *cameras)
        if (camera.is_object() && (camera.contains("Projection") || camera.contains("Position") ||
                                   camera.contains("Resolution")))
            return JsonKind::miv;
    return JsonKind::cameras;
}

Result<Json> readJson(const path& file, const Limits& limits) {
    STX_TRY(const auto bytes, readSetFile(file, limits));
    return within(inQuotes(file.string()), parseJson(bytes));
}

Result<Bytes> readSetFile(const path& file, const Limits& limits) {
    rememberNamedFile(file);
    return readFile(file, limits);
}

Result<void> readOwnKeys(const Json& camera, const std::string& where, SetView& view) {
    STX_TRY(const auto name, findText(camera, "stx:name", where));
    view.exactName = name.value_or("");
    for (const auto& [key, to] :
         {std::pair{"stx:pruned", &view.pruned}, std::pair{"stx:background", &view.background}}) {
        const auto it = camera.find(key);
        if (it == camera.end()) continue;
        if (!it->is_boolean())
            return failAt(where, ErrorCode::invalidInput, "'{}' must be true or false", key);
        *to = it->get<bool>();
    }
    STX_TRY(const auto noDepth, findText(camera, "stx:noDepth", where));
    if (noDepth) {
        view.noDepth = noDepthNamed(*noDepth);
        if (!view.noDepth)
            return failAt(where, ErrorCode::invalidInput,
                          "'stx:noDepth' is '{}'; 'empty' or 'unknown' is expected", *noDepth);
    }
    STX_TRY(const auto refined, findText(camera, "stx:refined", where));
    if (refined) {
        const auto found = Refined::from(*refined);
        if (!found)
            return failAt(where, ErrorCode::invalidInput,
                          "'stx:refined' is '{}'; steps and a number, as in 'noise,agree 0.003', "
                          "are expected",
                          *refined);
        view.refined = *found;
    }
    STX_TRY(const auto q, findNumbers(camera, "stx:quaternion", 4, where));
    if (q) {
        const glm::dquat exact((*q)[3], (*q)[0], (*q)[1], (*q)[2]);
        if (std::abs(glm::length(exact) - 1) < 1e-6 &&
            std::abs(glm::dot(exact, view.camera.orientation)) > 1 - 1e-9)
            view.camera.orientation = exact;
    }
    STX_TRY(const auto position, findNumbers(camera, "stx:position", 3, where));
    if (position) view.localPosition = glm::dvec3((*position)[0], (*position)[1], (*position)[2]);
    STX_TRY(const auto window, findNumbers(camera, "stx:window", 4, where));
    if (window) {
        Camera& c = view.camera;
        const double own[4] = {c.fx, c.fy, c.cx, c.cy};
        bool same = true;
        for (int i = 0; i < 4; ++i)
            same &= std::abs((*window)[static_cast<std::size_t>(i)] - own[i]) <=
                    1e-9 * (1 + std::abs(own[i]));
        if (same) {
            c.fx = (*window)[0];
            c.fy = (*window)[1];
            c.cx = (*window)[2];
            c.cy = (*window)[3];
        }
    }
    STX_TRY(const auto nearPlane, findNumber(camera, "nearPlane", where));
    STX_TRY(const auto farPlane, findNumber(camera, "farPlane", where));
    STX_TRY(const auto bits, findNumber(camera, "depthBits", where));
    if (!nearPlane || !farPlane || !bits) return {};
    if (!(*farPlane > *nearPlane))
        return failAt(where, ErrorCode::invalidInput,
                      "'nearPlane' {:g} must be below 'farPlane' {:g}", *nearPlane, *farPlane);
    view.planes = DepthCode{*nearPlane, *farPlane, *bits == 8 ? 255u : 65535u};
    view.depthBits = *bits == 8 ? 8 : *bits == 32 ? 32 : 16;
    return {};
}

Result<std::optional<glm::dvec3>> originOf(const Json& file, const std::string& where) {
    STX_TRY(const auto n, findNumbers(file, "stx:origin", 3, where));
    if (!n) return std::optional<glm::dvec3>();
    return std::optional(glm::dvec3((*n)[0], (*n)[1], (*n)[2]));
}

Result<path> environmentOf(const Json& file, const path& folder, const std::string& where,
                           const Limits& limits) {
    STX_TRY(const auto name, within(where, findText(file, "stx:environment", "")));
    if (!name) return path();
    return within(where, resolveInside(folder, *name, limits));
}

std::string firstThere(const path& folder, const std::vector<std::string>& names) {
    for (const std::string& name : names) {
        std::error_code ec;
        if (!name.empty() && std::filesystem::is_regular_file(folder / name, ec)) return name;
    }
    return {};
}

std::string withImageEnding(const path& folder, const std::string& name) {
    constexpr const char* kEndings[] = {".png",  ".jpg", ".jpeg", ".exr", ".webp", ".tif",
                                        ".tiff", ".PNG", ".JPG",  ".bmp", ".ppm"};
    // Sets of thousands of pictures name them whole: without a look at each.
    for (const char* ending : kEndings)
        if (name.ends_with(ending)) return name;
    std::error_code ec;
    if (!name.empty() && std::filesystem::is_regular_file(folder / name, ec)) return name;
    std::vector<std::string> names;
    for (const char* ending : kEndings) names.push_back(name + ending);
    const std::string found = firstThere(folder, names);
    return found.empty() ? name : found;
}

Result<PictureSource> sourceInside(const path& folder, const std::string& name,
                                   const std::string& where, const Limits& limits) {
    PictureSource source;
    source.name = name;
    auto file = resolveInside(folder, name, limits);
    if (file) {
        source.path = std::move(*file);
        return source;
    }
    Error error = where.empty() ? file.error() : file.error().at(where);
    std::error_code ec;
    if (error.code != ErrorCode::io || std::filesystem::exists(folder / name, ec))
        return tl::unexpected(std::move(error));
    source.path = folder / name;
    source.missing = std::move(error);
    return source;
}

Result<void> findPictures(const path& folder, const std::string& texture, const std::string& depth,
                          const std::string& where, const Limits& limits, SetView& view) {
    for (const auto& [name, to] : {std::pair{&texture, &view.texture}, {&depth, &view.depth}}) {
        auto source = sourceInside(folder, *name, where, limits);
        if (!source) return tl::unexpected(source.error());
        if (source->missing && !view.missing) view.missing = source->missing;
        *to = std::move(*source);
    }
    return {};
}

bool numbersInOrder(std::string_view a, std::string_view b) {
    const auto digit = [](std::string_view text, std::size_t at) {
        return at < text.size() && text[at] >= '0' && text[at] <= '9';
    };
    const auto numberEnd = [&](std::string_view text, std::size_t at) {
        while (digit(text, at)) ++at;
        return at;
    };
    const auto significant = [](std::string_view text, std::size_t at, std::size_t end) {
        while (at < end && text[at] == '0') ++at;
        return text.substr(at, end - at);
    };
    std::size_t i = 0, j = 0;
    bool fraction = false;
    while (i < a.size() && j < b.size()) {
        if (!digit(a, i) || !digit(b, j) || fraction) {
            if (a[i] != b[j])
                return static_cast<unsigned char>(a[i]) < static_cast<unsigned char>(b[j]);
            fraction = digit(a, i) ? fraction : a[i] == '.' && i > 0 && digit(a, i - 1);
            ++i;
            ++j;
            continue;
        }
        const std::size_t iEnd = numberEnd(a, i), jEnd = numberEnd(b, j);
        const auto x = significant(a, i, iEnd), y = significant(b, j, jEnd);
        if (x.size() != y.size()) return x.size() < y.size();
        if (x != y) return x < y;
        i = iEnd;
        j = jEnd;
    }
    if (i < a.size() || j < b.size()) return j < b.size();
    return a < b;  // they differ in leading zeros at most
}

std::vector<std::string> filesIn(const path& folder) {
    std::vector<std::string> names;
    std::error_code ec;
    for (std::filesystem::directory_iterator it(folder, ec), end; !ec && it != end;
         it.increment(ec)) {
        std::error_code ignored;
        if (it->is_regular_file(ignored)) names.push_back(it->path().filename().string());
    }
    std::sort(names.begin(), names.end(), numbersInOrder);
    return names;
}

Result<void> checkViewCount(std::uint64_t count, const Limits& limits, const std::string& where) {
    if (count > static_cast<std::uint64_t>(limits.maxViews))
        return failAt(where, ErrorCode::invalidInput,
                      "{} views; at most {} are possible (take each N-th with --every N)", count,
                      limits.maxViews);
    return {};
}

}  // namespace stx::imagesets
