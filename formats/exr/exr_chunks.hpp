#pragma once

#include <cstdint>
#include <functional>

#include "formats/exr/exr_file.hpp"

namespace stx::exr {

using ReadAt = std::function<bool(std::uint64_t offset, void* to, std::size_t size)>;

/// How a part is cut into chunks.
struct ChunkLayout {
    int firstX = 0, firstY = 0;         ///< of the data window
    int tileWidth = 0, tileHeight = 0;  ///< of tiles, of which only the largest level is looked at
    /// The number that stands before each chunk of files of several parts; -1 in other files.
    int part = -1;
};

/// Scan lines of a chunk of a compression (ExrPart::compression); 0 for any other number.
[[nodiscard]] int linesOfChunk(std::string_view compression);

/// Errors (invalidInput) when a chunk of the part is empty, not where the table says, or unpacks to
/// fewer bytes than its pixels take. OpenEXR does not look: it takes what was in its memory for the
/// pixels that lack. Deflated chunks are unpacked for this; what DWA's AC coefficients, PIZ and B44
/// hold is left to the library, which finds what lacks there. Memory of one chunk for each thread.
[[nodiscard]] Result<void> checkChunks(const ExrPart& part, const ChunkLayout& layout,
                                       const ExrChunks& chunks, const ReadAt& readAt);

}  // namespace stx::exr
