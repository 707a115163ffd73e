#pragma once

#include <cstdint>

/// What crosses the border to the module `stx_video`, in which libavformat and libavcodec live.
/// Both sides come from one build.
namespace stx::video {

inline constexpr std::uint32_t kTableVersion = 2;
/// The one symbol of the module: `const Table* stxVideo();`
inline constexpr const char* kTableSymbol = "stxVideo";

struct Table {
    std::uint32_t version = kTableVersion;
    /// Of the libraries that are loaded: "libavformat 59.27.100, libavcodec 59.37.100".
    const char* (*libraries)() = nullptr;
    /// Answers the requests of wire.hpp that come over a socket, until it is closed. To be called
    /// in a process of its own. `file`: an open file of video, or -1.
    void (*serve)(int socket, int file) = nullptr;
};

}  // namespace stx::video
