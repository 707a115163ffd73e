#include "formats/video/numbered_pictures.hpp"

#include <algorithm>
#include <charconv>
#include <map>
#include <optional>

#include "lib/base/counted.hpp"

namespace stx {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPictureEndings[] = {".png", ".jpg", ".jpeg", ".tif", ".tiff", ".webp",
                                                ".bmp", ".exr", ".ppm",  ".pgm", ".tga"};

bool isDigit(char c) {
    return c >= '0' && c <= '9';
}

/// The number that digits stand for; nothing when it is too large.
std::optional<std::int64_t> numberOf(std::string_view digits) {
    std::int64_t n = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), n);
    if (digits.empty() || error != std::errc() || end != digits.data() + digits.size())
        return std::nullopt;
    return n;
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
Result<void> inOrder(std::vector<NumberedPicture>& pictures, const std::string& name, Job& job) {
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

/// `name_%04d.png` in its parts.
struct SequencePattern {
    std::string prefix, suffix;
    std::size_t digits = 0;  ///< at least
};

std::optional<SequencePattern> parsePattern(const fs::path& pattern) {
    const std::string name = pattern.filename().string();
    const auto percent = name.find('%');
    if (percent == std::string::npos) return std::nullopt;
    std::size_t at = percent + 1;
    while (at < name.size() && isDigit(name[at])) ++at;
    if (at >= name.size() || name[at] != 'd' || at - percent > 4) return std::nullopt;
    SequencePattern out{name.substr(0, percent), name.substr(at + 1), 0};
    const auto digits = std::string_view(name).substr(percent + 1, at - percent - 1);
    out.digits = static_cast<std::size_t>(numberOf(digits).value_or(0));
    return out;
}

}  // namespace

Result<std::vector<NumberedPicture>> numberedPictures(const fs::path& folder, Job& job) {
    STX_TRY(const auto names, namesIn(folder));
    std::map<std::string, std::vector<NumberedPicture>> sequences;
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
        if (const auto number = numberOf(std::string_view(stem).substr(digits)))
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
    return parsePattern(pattern).has_value();
}

Result<std::vector<NumberedPicture>> picturesOfPattern(const fs::path& pattern, Job& job) {
    const auto parts = parsePattern(pattern);
    if (!parts)
        return fail(ErrorCode::usage, "'{}' has no %d, %04d or the like in it", pattern.string());
    const fs::path folder = pattern.has_parent_path() ? pattern.parent_path() : fs::path(".");
    STX_TRY(const auto names, namesIn(folder));
    std::vector<NumberedPicture> pictures;
    for (const std::string& name : names) {
        if (name.size() <= parts->prefix.size() + parts->suffix.size() ||
            !name.starts_with(parts->prefix) || !name.ends_with(parts->suffix))
            continue;
        const auto digits = std::string_view(name).substr(
            parts->prefix.size(), name.size() - parts->prefix.size() - parts->suffix.size());
        if (!std::all_of(digits.begin(), digits.end(), isDigit)) continue;
        // As printf writes it: filled up with zeros, and no more of them.
        if (digits.size() < parts->digits ||
            (digits.size() > std::max<std::size_t>(1, parts->digits) && digits[0] == '0'))
            continue;
        if (const auto number = numberOf(digits))
            pictures.push_back({*number, pattern.parent_path() / name});
    }
    if (pictures.empty())
        return fail(ErrorCode::io, "no file is named '{}', whatever the number", pattern.string());
    STX_CHECK(inOrder(pictures, pattern.string(), job));
    return pictures;
}

}  // namespace stx
