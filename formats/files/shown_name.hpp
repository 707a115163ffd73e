#pragma once

#include <filesystem>

namespace stx {

/// What a person knows a file by that is being written: the target of an OutputFile for its
/// temporaryPath(), or a name in the target of an OutputFolder for one in its. Other paths as they
/// are.
[[nodiscard]] std::filesystem::path shownName(const std::filesystem::path& path);

}  // namespace stx
