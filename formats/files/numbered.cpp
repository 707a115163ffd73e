#include "formats/files/numbered.hpp"

#include <algorithm>

#include "formats/files/files.hpp"
#include "lib/base/counted.hpp"
#include "lib/base/whole_number.hpp"

namespace stx {
namespace {

/// Where the name of a pattern's file, or of its last folder, begins and ends.
struct LastName {
    std::size_t begin = 0, end = 0;
};
LastName lastNameOf(std::string_view pattern) {
    LastName name{0, pattern.size()};
    while (name.end > 0 && pattern[name.end - 1] == '/') --name.end;
    const auto slash = pattern.substr(0, name.end).rfind('/');
    if (slash != std::string_view::npos) name.begin = slash + 1;
    return name;
}

/// `%04d` in a pattern.
struct Placeholder {
    std::size_t begin = 0, end = 0;
    int width = 0;
};

/// The first at `from` or behind, in the last name only.
std::optional<Placeholder> placeholderOf(std::string_view pattern, std::size_t from = 0) {
    const LastName name = lastNameOf(pattern);
    pattern = pattern.substr(0, name.end);
    for (auto percent = pattern.find('%', std::max(from, name.begin)); percent != pattern.npos;
         percent = pattern.find('%', percent + 1)) {
        std::size_t at = percent + 1;
        int width = 0;
        while (at < pattern.size() && pattern[at] >= '0' && pattern[at] <= '9' && at - percent < 4)
            width = width * 10 + (pattern[at++] - '0');
        if (at < pattern.size() && pattern[at] == 'd') return Placeholder{percent, at + 1, width};
    }
    return std::nullopt;
}

}  // namespace

std::optional<std::string> frameName(const std::string& pattern, int frame) {
    const auto place = placeholderOf(pattern);
    if (!place) return std::nullopt;
    return pattern.substr(0, place->begin) + fmt::format("{:0{}}", frame, place->width) +
           pattern.substr(place->end);
}

Result<void> checkPattern(const std::string& pattern) {
    if (const auto place = placeholderOf(pattern); place && placeholderOf(pattern, place->end))
        return fail(ErrorCode::usage,
                    "'{}' has several numbers; one is possible, as in name_%04d.png", pattern);
    return {};
}

Result<std::vector<NumberedFile>> numberedFiles(const std::string& pattern) {
    const std::filesystem::path path(pattern.substr(0, lastNameOf(pattern).end));
    const std::string name = path.filename().string();
    const auto place = placeholderOf(name);
    std::vector<NumberedFile> files;
    std::error_code error;
    for (std::filesystem::directory_iterator it(folderOf(path), error), end;
         place && !error && it != end; it.increment(error)) {
        const std::string found = it->path().filename().string();
        const std::string_view before = std::string_view(name).substr(0, place->begin);
        const std::string_view after = std::string_view(name).substr(place->end);
        if (found.size() <= before.size() + after.size() || !found.starts_with(before) ||
            !found.ends_with(after))
            continue;
        const std::string_view digits = std::string_view(found).substr(
            before.size(), found.size() - before.size() - after.size());
        const auto number = wholeNumber<decltype(NumberedFile::number)>(digits);
        // As the pattern writes it: `%04d` does not name a_5.exr.
        if (!number || *number < 0 || fmt::format("{:0{}}", *number, place->width) != digits)
            continue;
        NumberedFile file;
        file.number = *number;
        // Names are those of the pattern, without "./" in front.
        file.path = path.parent_path() / found;
        files.push_back(std::move(file));
    }
    if (error)
        return fail(ErrorCode::io, "cannot read the folder '{}': {}", folderOf(path).string(),
                    error.message());
    if (files.empty())
        return fail(ErrorCode::io, "cannot read '{}': no file is named so, whatever the number",
                    pattern);
    std::ranges::sort(files, {}, &NumberedFile::number);
    return files;
}

void noteOlderFiles(const std::string& pattern, std::size_t count, Job& job) {
    const auto files = numberedFiles(pattern);
    if (!files) return;
    const auto first = std::ranges::find_if(*files, [&](const NumberedFile& file) {
        return file.number >= static_cast<std::int64_t>(count);
    });
    if (first == files->end()) return;
    job.note(
        fmt::format("'{}' has {} from before, '{}' the first: they are not of the {} just "
                    "written, but are read with them; remove them, or give another name",
                    pattern, counted(static_cast<std::size_t>(files->end() - first), "file"),
                    first->path.string(), counted(count, "frame")));
}

std::optional<std::int64_t> firstMissing(const std::vector<NumberedFile>& files) {
    std::int64_t step = 0;
    for (std::size_t i = 1; i < files.size(); ++i) {
        const std::int64_t own = files[i].number - files[i - 1].number;
        step = step == 0 ? own : std::min(step, own);
    }
    for (std::size_t i = 1; i < files.size(); ++i)
        if (files[i].number - files[i - 1].number != step) return files[i - 1].number + step;
    return std::nullopt;
}

}  // namespace stx
