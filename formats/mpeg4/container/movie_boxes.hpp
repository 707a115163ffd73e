#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "formats/files/byte_io.hpp"
#include "formats/mpeg4/scene/document.hpp"

namespace stx::mpeg4 {

/// A track to write: its descriptor, its samples, what it is called.
struct WrittenTrack {
    std::uint32_t id = 0;
    ElementaryStream stream;
    std::string handler;
    std::string_view handlerName;
    std::vector<std::uint32_t> mpod;
    std::uint32_t clock = 0;  ///< id of the track whose clock it has (tref/sync); 0 = the scene's
    std::uint64_t bytes = 0;
    std::uint64_t start = 0;     ///< of the first sample, in the stream's timescale
    std::uint64_t duration = 0;  ///< from the first sample on, in the stream's timescale
    std::uint64_t offset = 0;    ///< of the only chunk
};

/// Writes `ftyp` and `moov` (ISO/IEC 14496-12 and -14) of the tracks; `wide`: chunks lie at offsets
/// of 64 bits. Their size does not depend on the offsets. SOURCE_DATE_EPOCH, when set, is the time
/// of creation. Errors: descriptors that cannot be coded.
/// Without `iod` there is no `iods` box.
[[nodiscard]] Result<void> writeMovieHead(ByteWriter& out, std::span<const WrittenTrack> tracks,
                                          const InitialObjectDescriptor* iod, bool wide);

}  // namespace stx::mpeg4
