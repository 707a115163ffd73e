#include "tools/output_names.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include "formats/files/named_files.hpp"
#include "formats/files/no_case.hpp"
#include "formats/files/numbered.hpp"

namespace stx::tools {
namespace {

namespace fs = std::filesystem;

/// Whether a file of that name is the main file of a folder.
bool isMainFile(const std::string& name) {
    static constexpr std::string_view kMainFiles[] = {
        "atlas.json",   "transforms.json", "cameras.json", "cameras.txt", "images.txt",
        "points3D.txt", "cameras.bin",     "images.bin",   "points3D.bin"};
    return std::ranges::find(kMainFiles, name) != std::end(kMainFiles);
}

/// An input, and the folders that are read with it: that of a main file, and the one that COLMAP's
/// "sparse" or "sparse/0" is in.
std::vector<std::string> placesReadWith(const std::string& path) {
    std::vector<std::string> places = {path};
    if (isMainFile(lastName(path))) {
        const fs::path folder = fs::path(path).parent_path();
        places.push_back(folder.empty() ? "." : folder.string());
    }
    for (const char* inside : {"0", "sparse"})
        if (lastName(places.back()) == inside) places.push_back(places.back() + "/..");
    return places;
}

/// Whether files of other names are written than the output's own. Not of one with {stem}, which
/// becomes a name for each input.
bool writesSeveral(const NamedPath& output) {
    std::error_code ec;
    return output.path.find('{') == std::string::npos &&
           (frameName(output.path, 0) || fs::is_directory(output.path, ec));
}

/// "-o 'b.exr' is the input 'a.exr'".
std::string clash(const NamedPath& output, const NamedPath& input) {
    return fmt::format("{} '{}' is {} '{}'", output.option, output.path,
                       input.option.empty() ? "the input" : input.option, input.path);
}

}  // namespace

fs::path wholePath(const std::string& path) {
    std::error_code ec;
    fs::path whole = fs::weakly_canonical(fs::absolute(path, ec), ec);
    if (ec) whole = fs::absolute(path, ec).lexically_normal();
    // "folder/" is the folder.
    return whole.has_filename() || !whole.has_relative_path() ? whole : whole.parent_path();
}

bool isNumberedFilm(const std::string& path) {
    std::error_code ec;
    return frameName(path, 0) && !fs::exists(path, ec);
}

bool isStandardOutput(std::string_view path) {
    static constexpr std::string_view kNames[] = {"-", "/dev/stdout", "/dev/fd/1",
                                                  "/proc/self/fd/1"};
    return std::ranges::find(kNames, path) != std::end(kNames);
}

std::optional<std::string> placeOf(const std::string& path) {
    if (path.empty() || path == "-") return std::nullopt;
    struct stat there = {};
    if (::stat(path.c_str(), &there) != 0) return wholePath(path).string();
    if (!S_ISREG(there.st_mode) && !S_ISDIR(there.st_mode)) return std::nullopt;
    return fmt::format("{}:{}", there.st_dev, there.st_ino);
}

bool samePath(const std::string& a, const std::string& b) {
    const auto place = placeOf(a);
    return place && place == placeOf(b);
}

Result<void> checkOutputNames(const std::vector<NamedPath>& outputs,
                              const std::vector<NamedPath>& inputs) {
    std::multimap<std::string, const NamedPath*> inputsAt;
    for (const NamedPath& input : inputs)
        for (const std::string& path : placesReadWith(input.path))
            if (auto place = placeOf(path)) inputsAt.emplace(std::move(*place), &input);
    std::map<std::string, const NamedPath*> outputAt;
    const NamedPath* streamed = nullptr;
    for (const NamedPath& output : outputs) {
        if (isStandardOutput(output.path)) {
            if (streamed)
                return fail(ErrorCode::usage,
                            "{} '{}' and {} '{}' are both standard output; write one of them to a "
                            "file",
                            streamed->option, streamed->path, output.option, output.path);
            streamed = &output;
            continue;
        }
        const auto place = placeOf(output.path);
        if (!place) continue;
        const auto [at, isNew] = outputAt.emplace(*place, &output);
        const NamedPath& other = *at->second;
        if (!isNew && output.path == other.path)
            return fail(ErrorCode::usage, "{} and {} are both '{}'; give them two names",
                        output.option, other.option, output.path);
        if (!isNew)
            return fail(ErrorCode::usage,
                        "{} '{}' and {} '{}' are the same file; give them two names", output.option,
                        output.path, other.option, other.path);
        const auto [first, end] = inputsAt.equal_range(*place);
        const auto lost = std::find_if(first, end, [&](const auto& known) {
            const NamedPath& input = *known.second;
            return !input.option.empty() || input.path != output.replaces ||
                   isNumberedFilm(input.path);
        });
        if (lost != end)
            return fail(ErrorCode::usage, "{}, which would be lost; give it another name",
                        clash(output, *lost->second));
    }
    return {};
}

std::string lastName(const std::string& path) {
    const auto end = path.find_last_not_of('/');
    const std::string whole = path.substr(0, end == std::string::npos ? 0 : end + 1);
    std::string name = whole.substr(whole.rfind('/') + 1);
    return name == "." || name == ".." ? wholePath(path).filename().string() : name;
}

std::vector<NamedPath> alikeAmong(const std::vector<std::string>& inputs,
                                  const std::vector<NamedPath>& outputs) {
    std::set<std::string> names, lastNames;
    for (const NamedPath& output : outputs) {
        for (const fs::path& path : {fs::path(output.path), wholePath(output.path)})
            for (const fs::path& part : path) names.insert(part.string());
        lastNames.insert(lastName(output.path));
    }
    std::vector<NamedPath> alike;
    const auto named = [&](const std::string& path) { return lastNames.contains(lastName(path)); };
    for (const std::string& input : inputs)
        if (names.contains(lastName(input)) || std::ranges::any_of(placesReadWith(input), named))
            alike.push_back({"", input});
    return alike;
}

void rememberInputs(const std::vector<NamedPath>& inputs, const std::vector<NamedPath>& outputs) {
    const bool many = std::ranges::any_of(outputs, writesSeveral);
    for (const NamedPath& input : inputs) {
        const auto same = [&](const NamedPath& o) { return samePath(o.path, input.path); };
        // Devices and pipes have no place, and nothing to lose.
        if (many && placeOf(input.path) && std::ranges::none_of(outputs, same))
            rememberInput(input.path);
        if (!isNumberedFilm(input.path)) continue;
        // Where none is there, opening the input says so.
        if (const auto files = numberedFiles(input.path))
            for (const NumberedFile& file : *files) rememberNamedFile(file.path);
    }
}

Result<void> checkReportIsNoMainFile(const std::string& report,
                                     const std::vector<NamedPath>& folders) {
    const fs::path file = wholePath(report);
    if (!isMainFile(file.filename().string())) return {};
    for (const NamedPath& folder : folders)
        for (fs::path up = file.parent_path(); up.has_relative_path(); up = up.parent_path())
            if (samePath(up.string(), folder.path))
                return fail(ErrorCode::usage,
                            "--report '{}' is a file that {} '{}' has itself, which would be "
                            "lost; give the report another name",
                            report, folder.option.empty() ? "the input" : folder.option,
                            folder.path);
    return {};
}

Result<void> checkReportIsBeside(const std::string& report, const std::vector<NamedPath>& outputs) {
    const fs::path file = wholePath(report);
    for (const NamedPath& output : outputs) {
        if (output.option != "-o" || isStandardOutput(output.path)) continue;
        const fs::path folder = wholePath(output.path);
        for (fs::path up = file.parent_path(); up.has_relative_path(); up = up.parent_path())
            if (up == folder)
                return fail(ErrorCode::usage,
                            "--report '{}' is in -o '{}', which is replaced as a whole; give a "
                            "name beside it",
                            report, output.path);
    }
    return {};
}

Result<void> checkReportName(std::string_view path) {
    if (const auto ending = endingOfMedia(path); !ending.empty())
        return fail(
            ErrorCode::usage,
            "--report is '{}', which ends in '{}'; a report is JSON (.json, or .jsonl of many "
            "inputs)",
            path, ending);
    return {};
}

bool mayHoldReport(const std::string& report, const std::vector<NamedPath>& others) {
    return checkReportName(report) && checkReportIsNoMainFile(report, others) &&
           checkReportIsBeside(report, others) &&
           std::ranges::none_of(others, [&](auto& o) { return samePath(o.path, report); });
}

std::string endingOfMedia(std::string_view path) {
    static constexpr std::string_view kEndings[] = {
        ".png", ".jpg", ".jpeg", ".heic", ".tif",   ".tiff",   ".webp", ".exr",  ".hdr",
        ".svg", ".mp4", ".bt",   ".xmt",  ".obj",   ".mtl",    ".glb",  ".gltf", ".stl",
        ".ply", ".spz", ".drc",  ".off",  ".dae",   ".fbx",    ".zip",  ".tar",  ".gz",
        ".yuv", ".y4m", ".pfm",  ".html", ".bin",   ".tga",    ".bmp",  ".gif",  ".psd",
        ".mkv", ".mov", ".avi",  ".webm", ".splat", ".ksplat", ".sog",  ".las",  ".laz",
        ".xyz", ".pcd", ".pts",  ".e57",  ".usd",   ".usdz",   ".3mf"};
    const std::string ending = fs::path(path).extension().string();
    const bool known =
        std::ranges::any_of(kEndings, [&](auto e) { return equalNoCase(e, ending); });
    return known ? ending : std::string();
}

}  // namespace stx::tools
