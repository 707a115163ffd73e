#pragma once

#include <filesystem>

#include "lib/base/result.hpp"

namespace stx {

/// The files that inputs name: the textures of a model, the pictures of a set. A program that
/// writes beside its inputs must not replace one by accident (`render amphora.obj -o amphora.png`).

/// From now on such files are remembered, and OutputFile::create() refuses their names. For
/// programs that end with their job; a library's caller may replace a file that it has read.
void guardNamedFiles();

/// Called for each file that is found by a name in another (resolveInside()). From any thread.
void rememberNamedFile(const std::filesystem::path& file);

/// Errors (usage) where the file that would be replaced is one that an input names.
[[nodiscard]] Result<void> checkIsNotNamed(const std::filesystem::path& target);

}  // namespace stx
