#pragma once

#include "formats/decoders/wire.hpp"
#include "formats/yuv/yuv_colour.hpp"

/// What is said between this process and the one that decodes video, beside the messages
/// themselves: a request and its answer, one after the other.
namespace stx::video {

using decoders::Packer;
using decoders::Tag;
using decoders::Unpacker;

/// How the samples of a picture lie behind this header: planes Y, Cb, Cr and alpha from the top,
/// without gaps, or 8-bit RGBA.
struct PictureHeader {
    std::int32_t width = 0, height = 0;
    /// Of a sample; above 8 in two bytes, little-endian. Of RGBA: those that the video has, 8
    /// to 16.
    std::int32_t bits = 8;
    std::int32_t chromaShiftX = 0, chromaShiftY = 0;
    std::uint8_t chroma = 0, chromaLeft = 0;
    YuvMatrix matrix = YuvMatrix::bt709;  ///< by which it is decoded
    std::uint8_t fullRange = 0, rgba = 0;
    std::uint8_t limitedSaid = 0;  ///< the stream itself says that its range is limited
    /// What the stream says of its colours, by the numbers of ITU-T H.273; 2: nothing.
    std::uint8_t primariesSaid = 2, transferSaid = 2, matrixSaid = 2;
    std::uint8_t alpha = 0;  ///< the stream has it: a last plane as large as Y, of full range, or A
    std::uint8_t unused[2] = {};
};

struct EncoderRequest {
    std::int32_t width = 0, height = 0;
    std::int32_t bits = 8;  ///< 8 or 10
    /// H.264's chroma_format_idc: 0 is luma alone, 1 4:2:0, 3 4:4:4.
    std::int32_t chromaFormat = 1;
    std::int32_t crf = -1;        ///< 0..51; -1: lossless
    std::uint32_t timescale = 0;  ///< ticks a second
    double rate = 25;             ///< pictures a second, on average
};

/// How players turn and mirror the pictures of a track: what is at (x, y) is shown at (ax + cy,
/// bx + dy), moved into the picture (ISO/IEC 14496-12, 8.3.2). Phones write it.
struct Turn {
    std::int8_t a = 1, b = 0, c = 0, d = 1;
    [[nodiscard]] bool none() const { return a == 1 && d == 1; }
    [[nodiscard]] bool sideways() const { return a == 0; }
};

}  // namespace stx::video
