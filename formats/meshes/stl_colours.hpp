#pragma once

#include <optional>
#include <vector>

#include <glm/glm.hpp>

#include "formats/files/files.hpp"

namespace stx {

/// How many facets a binary STL has, which may have more bytes behind them; nothing when the bytes
/// are none.
[[nodiscard]] std::optional<std::uint32_t> facetsOfBinaryStl(ByteSpan bytes);

/// How many bytes of a binary STL are behind its last facet; 0 when the bytes are none.
[[nodiscard]] std::uint64_t bytesBehindBinaryStl(ByteSpan bytes);

/// A text STL whose keywords are in upper case with these in lower case, as Assimp wants them;
/// nothing when they are, or when it is not a text.
[[nodiscard]] std::optional<Bytes> lowerCaseStl(ByteSpan bytes);

/// The colours of the corners of a binary STL in sRGB, as the two bytes behind each facet say
/// (Wikipedia, "STL (file format)"). `colours` has what Assimp gives, which takes bit 15 for a
/// colour everywhere and masks five bits with 0x31: three for each facet, or none.
/// Magics, whose header has COLOR= and the colour of the object: bit 15 is clear where a facet has
/// its own, red in the lowest five bits; the others have the object's. MeshLab sets bit 15 of
/// all facets under that header, and means their own. A file of zeros has the object's, too.
/// VisCAM and SolidView: bit 15 is set where a facet has its own, blue in the lowest five bits; the
/// others are plain grey.
void readStlColours(ByteSpan bytes, std::vector<glm::vec4>& colours);

}  // namespace stx
