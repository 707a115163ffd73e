#pragma once

#include "formats/files/files.hpp"
#include "lib/base/job.hpp"

namespace stx {

// Assimp walks through nested elements by recursion and believes the lengths that a file claims, so
// both are held against the limits before it sees the file. What is damaged in another way passes:
// Assimp says what is wrong with it.

/// COLLADA: errors (invalidInput) when elements are nested deeper than limits.maxNesting.
[[nodiscard]] Result<void> checkColladaClaims(ByteSpan text, const Limits& limits);

/// FBX, binary or ASCII: the same, and errors when the arrays of a binary file, unpacked, take more
/// than the memory limit.
[[nodiscard]] Result<void> checkFbxClaims(ByteSpan bytes, const Limits& limits);

/// STL: errors (invalidInput) when a text does not end with the word that says so; binary files
/// pass.
[[nodiscard]] Result<void> checkStlEnd(ByteSpan bytes);

}  // namespace stx
