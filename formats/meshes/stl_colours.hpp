#pragma once

#include <optional>
#include <vector>

#include <glm/glm.hpp>

#include "formats/files/files.hpp"

namespace stx {

/// How many facets a binary STL has; nothing when the bytes are none.
[[nodiscard]] std::optional<std::uint32_t> facetsOfBinaryStl(ByteSpan bytes);

/// The colours of the corners of a binary STL in sRGB, as the two bytes behind each facet say
/// (Wikipedia, "STL (file format)"):
///  - Magics, whose header has COLOR= and the object's colour: bit 15 is clear where a facet has
///  its
///    own, red in the lowest five bits. All others have the object's.
///  - VisCAM and SolidView: bit 15 is set where a facet has its own, blue in the lowest five bits.
///    The others keep what `colours` has.
/// Assimp takes a set bit for a colour in both, and masks five bits with 0x31. `colours` has what
/// it gives: three for each facet, or none.
void readStlColours(ByteSpan bytes, std::vector<glm::vec4>& colours);

}  // namespace stx
