#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "formats/files/files.hpp"

namespace stx::photos {

/// What a JPEG holds beside its picture (ISO/IEC 10918-1, B.1.1.4). Spans lie in the file.
struct JpegSegments {
    ByteSpan exif;          ///< APP1 `Exif`: the TIFF
    ByteSpan xmp;           ///< APP1: the standard packet
    ByteSpan mpf;           ///< APP2 `MPF`: the TIFF (CIPA DC-007)
    std::size_t mpfAt = 0;  ///< where that TIFF begins in the file
    Bytes profile;          ///< APP2 `ICC_PROFILE`, put together; empty when parts are missing
    /// APP1: parts of extended XMP as they come, by their GUID.
    struct Part {
        std::string guid;
        std::uint32_t total = 0, offset = 0;
        ByteSpan bytes;
    };
    std::vector<Part> extended;
    /// The frame is lossless (SOF3), which libjpeg-turbo does not decode.
    bool lossless = false;
};

/// Walks over the segments before the first scan. What is damaged ends it: the decoder says why.
[[nodiscard]] JpegSegments readJpegSegments(ByteSpan file);

/// The extended XMP of one GUID (the one in xmpNote:HasExtendedXMP). Errors (invalidInput): parts
/// overlap or are missing, with where; the GUID is not their MD5; more than 64 MiB.
[[nodiscard]] Result<Bytes> extendedXmp(const JpegSegments& segments, std::string_view guid);

/// Bytes of the JPEG that `file` begins with, up to the end marker; nothing where it has none.
[[nodiscard]] std::optional<std::size_t> jpegLength(ByteSpan file);

/// Where the pictures of a multi-picture file begin, the first (0) included. Errors (invalidInput):
/// a directory that is cut off, an offset outside of the file or at no JPEG.
[[nodiscard]] Result<std::vector<std::size_t>> mpfPictures(ByteSpan file,
                                                           const JpegSegments& segments);

/// Whether bytes begin as a JPEG.
[[nodiscard]] bool isJpeg(ByteSpan bytes);

}  // namespace stx::photos
