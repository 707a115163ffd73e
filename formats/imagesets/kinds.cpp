#include "formats/imagesets/kinds.hpp"

#include <algorithm>

#include "formats/imagesets/messages.hpp"

namespace stx::imagesets {

JsonKind jsonKindOf(const Json& file) {
    if (!file.is_object()) return JsonKind::none;
    const auto list = [&](const char* key) {
        const auto it = file.find(key);
        return it != file.end() && it->is_array() ? &*it : nullptr;
    };
    if (list("frames")) return JsonKind::transforms;
    const Json* cameras = list("cameras");
    if (!cameras) return JsonKind::none;
    for (const Json& camera : *cameras)
        if (camera.is_object() && (camera.contains("Projection") || camera.contains("Position") ||
                                   camera.contains("Resolution")))
            return JsonKind::miv;
    return JsonKind::cameras;
}

Result<Json> readJson(const path& file, const Limits& limits) {
    STX_TRY(const auto bytes, readFile(file, limits));
    return within(inQuotes(file.string()), parseJson(bytes));
}

std::string firstThere(const path& folder, const std::vector<std::string>& names) {
    for (const std::string& name : names) {
        std::error_code ec;
        if (!name.empty() && std::filesystem::is_regular_file(folder / name, ec)) return name;
    }
    return {};
}

std::string withImageEnding(const path& folder, const std::string& name) {
    std::vector<std::string> names{name};
    for (const char* ending : {".png", ".jpg", ".jpeg", ".exr", ".webp", ".tif", ".tiff", ".PNG",
                               ".JPG", ".bmp", ".ppm"})
        names.push_back(name + ending);
    const std::string found = firstThere(folder, names);
    return found.empty() ? name : found;
}

Result<PictureSource> sourceInside(const path& folder, const std::string& name,
                                   const std::string& where, const Limits& limits) {
    PictureSource source;
    source.name = name;
    auto file = resolveInside(folder, name, limits);
    if (!file) return tl::unexpected(where.empty() ? file.error() : file.error().at(where));
    source.path = std::move(*file);
    return source;
}

std::vector<std::string> filesIn(const path& folder) {
    std::vector<std::string> names;
    std::error_code ec;
    for (std::filesystem::directory_iterator it(folder, ec), end; !ec && it != end;
         it.increment(ec)) {
        std::error_code ignored;
        if (it->is_regular_file(ignored)) names.push_back(it->path().filename().string());
    }
    std::sort(names.begin(), names.end());
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
