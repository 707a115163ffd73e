#include "tools/output_names.hpp"

#include <algorithm>
#include <filesystem>

#include "formats/files/named_files.hpp"
#include "formats/files/no_case.hpp"
#include "formats/files/numbered.hpp"

namespace stx::tools {
namespace {

namespace fs = std::filesystem;

fs::path wholePath(const std::string& path) {
    std::error_code ec;
    fs::path whole = fs::weakly_canonical(fs::absolute(path, ec), ec);
    if (ec) whole = fs::absolute(path, ec).lexically_normal();
    // "folder/" is the folder.
    return whole.has_filename() || !whole.has_relative_path() ? whole : whole.parent_path();
}

/// Whether it names a film of numbered files: a file may have such a name itself.
bool isNumberedFilm(const std::string& path) {
    std::error_code ec;
    return frameName(path, 0) && !fs::exists(path, ec);
}

/// "-o 'b.exr' is the input 'a.exr'".
std::string clash(const NamedPath& output, const NamedPath& input) {
    return fmt::format("{} '{}' is {} '{}'", output.option, output.path,
                       input.option.empty() ? "the input" : input.option, input.path);
}

}  // namespace

bool samePath(const std::string& a, const std::string& b) {
    if (a.empty() || b.empty() || a == "-" || b == "-") return false;
    std::error_code ec;
    const auto there = fs::status(a, ec);
    if (fs::exists(there) && fs::exists(b, ec))
        return (fs::is_regular_file(there) || fs::is_directory(there)) && fs::equivalent(a, b, ec);
    return wholePath(a) == wholePath(b);
}

Result<void> checkOutputNames(const std::vector<NamedPath>& outputs,
                              const std::vector<NamedPath>& inputs) {
    const auto alone = std::ranges::count(inputs, "", &NamedPath::option);
    for (auto output = outputs.begin(); output != outputs.end(); ++output) {
        for (auto other = outputs.begin(); other != output; ++other) {
            if (!samePath(output->path, other->path)) continue;
            if (output->path == other->path)
                return fail(ErrorCode::usage, "{} and {} are both '{}'; give them two names",
                            output->option, other->option, output->path);
            return fail(ErrorCode::usage,
                        "{} '{}' and {} '{}' are the same file; give them two names",
                        output->option, output->path, other->option, other->path);
        }
        for (const NamedPath& input : inputs) {
            const bool itself = output->replaces && input.option.empty() && alone == 1 &&
                                !isNumberedFilm(input.path);
            if (!itself && samePath(output->path, input.path))
                return fail(ErrorCode::usage, "{}, which would be lost; give it another name",
                            clash(*output, input));
        }
    }
    return {};
}

void rememberNumberedInputs(const std::vector<NamedPath>& inputs) {
    for (const NamedPath& input : inputs) {
        if (!isNumberedFilm(input.path)) continue;
        // Where none is there, opening the input says so.
        if (const auto files = numberedFiles(input.path))
            for (const NumberedFile& file : *files) rememberNamedFile(file.path);
    }
}

Result<void> checkReportIsNoMainFile(const std::string& report,
                                     const std::vector<NamedPath>& folders) {
    static constexpr std::string_view kMainFiles[] = {"atlas.json",   "transforms.json",
                                                      "cameras.json", "cameras.txt",
                                                      "images.txt",   "points3D.txt"};
    const fs::path file = wholePath(report);
    if (std::ranges::find(kMainFiles, file.filename().string()) == std::end(kMainFiles)) return {};
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

Result<void> checkReportName(std::string_view path) {
    if (const auto ending = endingOfMedia(path); !ending.empty())
        return fail(
            ErrorCode::usage,
            "--report is '{}', which ends in '{}'; a report is JSON (.json, or .jsonl of many "
            "inputs)",
            path, ending);
    return {};
}

std::string endingOfMedia(std::string_view path) {
    static constexpr std::string_view kEndings[] = {
        ".png",  ".jpg", ".jpeg", ".heic", ".tif", ".tiff", ".webp", ".exr", ".hdr", ".svg",
        ".mp4",  ".bt",  ".xmt",  ".obj",  ".mtl", ".glb",  ".gltf", ".stl", ".ply", ".spz",
        ".drc",  ".off", ".dae",  ".fbx",  ".zip", ".tar",  ".gz",   ".yuv", ".y4m", ".pfm",
        ".html", ".bin", ".tga",  ".bmp",  ".gif", ".psd",  ".mkv",  ".mov", ".avi", ".webm"};
    const std::string ending = fs::path(path).extension().string();
    const bool known =
        std::ranges::any_of(kEndings, [&](auto e) { return equalNoCase(e, ending); });
    return known ? ending : std::string();
}

}  // namespace stx::tools
