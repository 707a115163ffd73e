#pragma once

#include <optional>
#include <string_view>

#include <glm/glm.hpp>

#include "formats/files/files.hpp"

namespace stx {

/// A model's text with an origin subtracted from its coordinates.
struct ShiftedText {
    Bytes text;
    glm::dvec3 origin{0.0};
};

/// Assimp reads coordinates as floats, which round those of maps (4000000.1 becomes
/// 4000000). So the lines that begin with `keyword` ("v" of OBJ, "vertex" of
/// STL) are read in double precision first, and where originFor() finds their coordinates too
/// large, rewritten from that origin. Nothing when they are fine, or when a line is not understood
/// (then Assimp says what is wrong with it).
[[nodiscard]] std::optional<ShiftedText> shiftLargeCoordinates(ByteSpan text,
                                                               std::string_view keyword);

}  // namespace stx
