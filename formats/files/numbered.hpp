#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "lib/base/job.hpp"
#include "lib/base/result.hpp"

namespace stx {

/// The file of one frame of a sequence named `name_%04d.png`; nothing when the name has no number.
/// The number, `%d` or `%Nd` with up to three digits, is in the file's name, or in the last
/// folder's of a path of folders: folders before it keep theirs. Any other `%` is itself.
[[nodiscard]] std::optional<std::string> frameName(const std::string& pattern, int frame);

/// Errors (usage) when that name has more than one number: `a_%d_%d.png`.
[[nodiscard]] Result<void> checkPattern(const std::string& pattern);

/// A file of such a sequence.
struct NumberedFile {
    std::int64_t number = 0;
    std::filesystem::path path;
};
/// The files there are of a pattern, by number, each once. The number, from 0, is in the
/// name as printf would write it. Errors (io): none is there.
[[nodiscard]] Result<std::vector<NumberedFile>> numberedFiles(const std::string& pattern);

/// The number of the first file that is missing between others; nothing where all are there.
/// Numbers may count in steps: the least difference is the usual one.
[[nodiscard]] std::optional<std::int64_t> firstMissing(const std::vector<NumberedFile>& files);

/// Notes the files of a pattern that are not of the film just written, frames 0 to `count` - 1:
/// they were there before, and whoever reads the film takes them for its end.
void noteOlderFiles(const std::string& pattern, std::size_t count, Job& job);

}  // namespace stx
