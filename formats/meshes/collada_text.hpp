#pragma once

#include <optional>
#include <string>

#include "formats/files/files.hpp"

namespace stx {

/// COLLADA text in which each `lookat` and `skew` is the `matrix` that it means (COLLADA 1.4.1,
/// chapter 5). Assimp takes the up of a lookat for an axis as it is, which shears where it is not
/// at right angles to the view, and ends itself at a skew. Nothing when the text has neither. What
/// has too few numbers, and a lookat without a direction aside of its up, stay as they are. Errors
/// (invalidInput): a skew whose angle reaches its axis of translation.
[[nodiscard]] Result<std::optional<std::string>> withMatrices(ByteSpan text);

}  // namespace stx
