#include "formats/video/numbered_pictures.hpp"

#include <algorithm>
#include <map>
#include <optional>

#include "lib/base/counted.hpp"
#include "lib/base/whole_number.hpp"

namespace stx {
namespace {

namespace fs = std::filesystem;

/// Also those that are not read here, so that they are not left out without a word.
constexpr std::string_view kPictureEndings[] = {
    ".png", ".jpg", ".jpeg", ".tif", ".tiff", ".webp", ".bmp", ".exr",  ".ppm",  ".pgm",
    ".tga", ".hdr", ".jp2",  ".gif", ".psd",  ".dds",  ".sgi", ".heic", ".heif", ".avif"};

bool isDigit(char c) {
    return c >= '0' && c <= '9';
}

Result<std::vector<std::string>> namesIn(const fs::path& folder) {
    std::error_code ec;
    std::vector<std::string> names;
    fs::directory_iterator it(folder, ec);
    for (; !ec && it != fs::directory_iterator(); it.increment(ec))
        names.push_back(it->path().filename().string());
    if (ec)
        return fail(ErrorCode::io, "cannot read the folder '{}': {}", folder.string(),
                    ec.message());
    return names;
}

/// Sorts, and says what is missing. Error (invalidInput) when two have one number.
Result<void> inOrder(std::vector<NumberedFile>& pictures, const std::string& name, Job& job) {
    std::sort(pictures.begin(), pictures.end(), [](const auto& a, const auto& b) {
        return a.number != b.number ? a.number < b.number : a.path < b.path;
    });
    std::int64_t step = 0;
    for (std::size_t i = 1; i < pictures.size(); ++i) {
        const std::int64_t here = pictures[i].number - pictures[i - 1].number;
        if (here == 0)
            return fail(ErrorCode::invalidInput, "'{}' and '{}' have the same number",
                        pictures[i - 1].path.string(), pictures[i].path.string());
        step = step == 0 ? here : std::min(step, here);
    }
    std::int64_t missing = 0;
    std::optional<std::int64_t> first;
    for (std::size_t i = 1; i < pictures.size(); ++i) {
        const std::int64_t here = pictures[i].number - pictures[i - 1].number;
        if (here > step && !first) first = pictures[i - 1].number + step;
        missing += here / step - 1;
    }
    if (first)
        job.note(
            fmt::format("'{}': {} missing from the sequence, the first is number {}; the "
                        "others are taken",
                        name, counted(missing, "frame is", "frames are"), *first));
    return {};
}

}  // namespace

Result<std::vector<NumberedFile>> numberedPictures(const fs::path& folder, Job& job) {
    STX_TRY(const auto names, namesIn(folder));
    std::map<std::string, std::vector<NumberedFile>> sequences;
    for (const std::string& name : names) {
        const fs::path path(name);
        std::string ending = path.extension().string();
        std::transform(ending.begin(), ending.end(), ending.begin(), [](char c) {
            return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
        });
        if (std::find(std::begin(kPictureEndings), std::end(kPictureEndings), ending) ==
            std::end(kPictureEndings))
            continue;
        const std::string stem = path.stem().string();
        std::size_t digits = stem.size();
        while (digits > 0 && isDigit(stem[digits - 1])) --digits;
        if (const auto number = wholeNumber<std::int64_t>(std::string_view(stem).substr(digits)))
            sequences[stem.substr(0, digits) + "#" + ending].push_back({*number, folder / name});
    }
    if (sequences.empty())
        return fail(ErrorCode::invalidInput,
                    "the folder '{}' holds no numbered pictures (frame_0001.png, …)",
                    folder.string());
    if (sequences.size() > 1) {
        std::vector<std::string> list;
        for (const auto& [name, pictures] : sequences)
            if (list.size() < 4)
                list.push_back(fmt::format("{} ({})", name, counted(pictures.size(), "picture")));
        return fail(ErrorCode::invalidInput,
                    "the folder '{}' holds {} sequences: {}; name one of them, as in '{}'",
                    folder.string(), sequences.size(), fmt::join(list, ", "),
                    (folder / "name_%04d.png").string());
    }
    auto pictures = std::move(sequences.begin()->second);
    STX_CHECK(inOrder(pictures, folder.string(), job));
    return pictures;
}

bool isSequencePattern(const fs::path& pattern) {
    return frameName(pattern.string(), 0).has_value();
}

Result<std::vector<NumberedFile>> picturesOfPattern(const fs::path& pattern, Job& job) {
    STX_TRY(auto pictures, numberedFiles(pattern.string()));
    STX_CHECK(inOrder(pictures, pattern.string(), job));
    return pictures;
}

}  // namespace stx
