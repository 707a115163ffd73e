#pragma once

#include <filesystem>
#include <vector>

#include "formats/files/numbered.hpp"
#include "lib/base/job.hpp"

namespace stx {

/// The pictures of a folder whose names end in a number (`in000003.png`), by rising number. Numbers
/// that are missing, beside a step that all share, are said in a note. Errors: io; invalidInput
/// when there are none, or several sequences.
[[nodiscard]] Result<std::vector<NumberedFile>> numberedPictures(
    const std::filesystem::path& folder, Job& job);

/// Whether a name stands for a sequence: `name_%04d.png`.
[[nodiscard]] bool isSequencePattern(const std::filesystem::path& pattern);
/// The files of such a sequence that are there, by rising number. As above.
[[nodiscard]] Result<std::vector<NumberedFile>> picturesOfPattern(
    const std::filesystem::path& pattern, Job& job);

}  // namespace stx
