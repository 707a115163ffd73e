#pragma once

#include <cstddef>
#include <cstdint>

/// What crosses the border to the module `stx_codecs`, in which OpenImageIO lives: plain structs
/// and functions, so that nothing of that library is needed on our side. Both sides come from one
/// build.
namespace stx::codecs {

inline constexpr std::uint32_t kTableVersion = 3;
/// The one symbol of the module: `const Table* stxCodecs();`
inline constexpr const char* kTableSymbol = "stxCodecs";

/// Why a call failed; `code` is an ErrorCode.
struct Failure {
    int code = 0;
    char message[1024] = {};
};

/// What a file holds, given before its pixels are decoded.
struct Header {
    int width = 0, height = 0, channels = 0;
    int bits = 0;                  ///< how the values come: 8 and 16 unsigned, 32 float
    int originX = 0, originY = 0;  ///< the data window in the display window
    int displayWidth = 0, displayHeight = 0;
    bool linear = false;
    bool premultiplied = false;
    const char* const* channelNames = nullptr;  ///< `channels` of them, valid during the callback
};

struct DecodeRequest {
    const void* bytes = nullptr;
    std::size_t size = 0;
    /// A name with the ending of the format, for formats that first bytes do not show.
    const char* name = nullptr;
    void* context = nullptr;
    /// Checks the header, gives room for width * height * channels values, or null (with
    /// `failure`).
    void* (*allocate)(void* context, const Header& header, Failure& failure) = nullptr;
};

/// A picture of 8 bits a channel to be written, sRGB, straight alpha, nothing lost.
struct EncodeRequest {
    const char* path = nullptr;    ///< of a file, whose name need not show the format
    const char* format = nullptr;  ///< "tiff" or "webp"
    int width = 0, height = 0;
    int channels = 0;  ///< 3 or 4
    const std::uint8_t* values = nullptr;
    const char* date = nullptr;  ///< TIFF's DateTime: "1970:01:02 03:04:05"
};

struct Table {
    std::uint32_t version = kTableVersion;
    /// True, or false with a failure.
    bool (*decode)(const DecodeRequest& request, Failure& failure) = nullptr;
    bool (*encode)(const EncodeRequest& request, Failure& failure) = nullptr;
};

}  // namespace stx::codecs
