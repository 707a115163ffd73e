#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "lib/base/result.hpp"

namespace stx {

/// The file of one frame of a sequence named `name_%04d.png`; nothing when the name has no number.
[[nodiscard]] std::optional<std::string> frameName(const std::string& pattern, int frame);

/// A file of such a sequence.
struct NumberedFile {
    std::int64_t number = 0;
    std::filesystem::path path;
};
/// The files there are of a pattern, by number, each once. The number, from 0, is in the file's
/// name as printf would write it, and not in a folder's. Errors (io): none is there.
[[nodiscard]] Result<std::vector<NumberedFile>> numberedFiles(const std::string& pattern);

}  // namespace stx
