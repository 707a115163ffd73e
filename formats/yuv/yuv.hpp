#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "formats/yuv/yuv_colour.hpp"
#include "lib/base/image.hpp"
#include "lib/base/job.hpp"
#include "lib/model/texture.hpp"

namespace stx {

/// Raw planes of a .yuv file: Y, then Cb and Cr, rows from the top, without padding.
struct YuvFormat {
    int width = 0, height = 0;
    int bits = 8;  ///< above 8 in two bytes, little-endian, in the low bits
    int chromaShiftX = 1, chromaShiftY = 1;
    bool chroma = true;
    /// Of halved columns: a chroma sample lies on the left one of its two pixels (MPEG-2), instead
    /// of in their middle.
    bool chromaLeft = false;

    [[nodiscard]] std::uint64_t frameBytes() const;
};

/// Names as in FFmpeg: yuv420p, yuv420p10le, yuv422p, yuv444p16le, yuv400p, gray, gray16le...
/// Width and height are left to the caller.
[[nodiscard]] std::optional<YuvFormat> yuvFormatNamed(std::string_view name);

/// Frames in a file. Errors when its size is not a whole number of them, or it has none.
[[nodiscard]] Result<int> yuvFrameCount(const std::filesystem::path& path, const YuvFormat& format);

/// One frame in memory, of format.frameBytes() bytes, as 8-bit RGB; chroma is interpolated, its
/// samples in the middle of their pixels' rows. Errors (invalidInput): a value beyond the bits;
/// memory over the limit. `name` is for messages.
[[nodiscard]] Result<Rgba8Image> rgbFromYuv(std::span<const std::byte> frame,
                                            const YuvFormat& format, const YuvColour& colour,
                                            const std::string& name, const Limits& limits);

/// The same of one frame of a file.
[[nodiscard]] Result<Rgba8Image> readYuvColour(const std::filesystem::path& path,
                                               const YuvFormat& format, int frame,
                                               const YuvColour& colour, const Limits& limits);

/// The Y plane of one frame, as it is stored.
[[nodiscard]] Result<Image<float>> readYuvLuma(const std::filesystem::path& path,
                                               const YuvFormat& format, int frame,
                                               const Limits& limits);

}  // namespace stx
