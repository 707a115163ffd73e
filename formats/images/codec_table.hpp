#pragma once

#include <cstdint>

/// How this process writes pictures with the module `stx_codecs`, in which OpenImageIO lives: plain
/// structs and functions, so that nothing of that library is needed on our side. Both sides come
/// from one build. It reads them in a process of its own only (formats/decoders).
namespace stx::codecs {

inline constexpr std::uint32_t kTableVersion = 4;
/// The one symbol of the module: `const Table* stxCodecs();`
inline constexpr const char* kTableSymbol = "stxCodecs";

/// Why a call failed; `code` is an ErrorCode.
struct Failure {
    int code = 0;
    char message[1024] = {};
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
    bool (*encode)(const EncodeRequest& request, Failure& failure) = nullptr;
};

}  // namespace stx::codecs
