#include "formats/imagesets/recognise.hpp"

#include <algorithm>
#include <array>

#include "formats/imagesets/messages.hpp"

namespace stx {
namespace imagesets {
namespace {

const std::vector<KindEntry>& entries() {
    static const std::vector<KindEntry> all = {
        {{"transforms", "transforms.json of NeRF, nerfstudio, instant-ngp and Blender"},
         describeTransforms},
        {{"miv", "camera list of MPEG's immersive video (TMIV) or RVS, with PNG or YUV files"},
         describeMiv},
        {{"cameras", "a folder with our own cameras.json"}, describeCamerasJson},
    };
    return all;
}

/// The kind of a JSON file by its keys, from its beginning alone when that tells.
std::string kindOfJson(const path& file) {
    Limits limits;
    limits.maxMemoryBytes = 256u << 20;
    const auto json = readJson(file, limits);
    if (!json) return {};
    switch (jsonKindOf(*json)) {
        case JsonKind::transforms:
            return "transforms";
        case JsonKind::miv:
            return "miv";
        case JsonKind::cameras:
            return "cameras";
        case JsonKind::none:
            break;
    }
    return {};
}

}  // namespace

const KindEntry* kindNamed(std::string_view name) {
    for (const KindEntry& entry : entries())
        if (entry.kind.name == name) return &entry;
    return nullptr;
}

}  // namespace imagesets

const std::vector<ImageSetKind>& imageSetKinds() {
    static const std::vector<ImageSetKind> kinds = [] {
        std::vector<ImageSetKind> all;
        for (const auto& entry : imagesets::entries()) all.push_back(entry.kind);
        return all;
    }();
    return kinds;
}

Result<std::string> recogniseImageSet(const std::filesystem::path& path) {
    using namespace imagesets;
    namespace fs = std::filesystem;
    std::error_code ec;
    const std::string where = inQuotes(path.string());
    if (!fs::exists(path, ec))
        return failAt(where, ErrorCode::io, "there is no such file or folder");
    if (!fs::is_directory(path, ec)) {
        if (path.extension() == ".json") {
            const std::string kind = kindOfJson(path);
            if (!kind.empty()) return kind;
        }
        return failAt(
            where, ErrorCode::invalidInput,
            "this is no image set: a .json with cameras, calib.txt, calibParams-*.txt, an "
            ".exr with Z, or a folder is expected");
    }
    if (fs::is_regular_file(path / "transforms.json", ec)) return std::string("transforms");
    const std::vector<std::string> files = filesIn(path);
    for (const std::string& name : files) {
        if (fs::path(name).extension() != ".json") continue;
        const std::string kind = kindOfJson(path / name);
        if (kind == "miv" || (kind == "cameras" && name == "cameras.json")) return kind;
    }
    return failAt(where, ErrorCode::invalidInput,
                  "no image set is recognised in this folder: transforms.json, cameras.json, "
                  "calib.txt, calibParams-*.txt, sparse/, pose.txt, groundtruth.txt or "
                  "frame-*.pose.txt is expected");
}

}  // namespace stx
