#pragma once

#include <cstdint>

/// What crosses the border to a module of decoders, in which a foreign library lives. Modules are
/// opened by stx-decode only. Both sides come from one build.
namespace stx::decoders {

inline constexpr std::uint32_t kModuleVersion = 1;
/// The symbol of a module: `const Module* stxDecoder();`
inline constexpr const char* kModuleSymbol = "stxDecoder";

struct Module {
    std::uint32_t version = kModuleVersion;
    /// Of the libraries that are loaded: "libavformat 59.27.100, libavcodec 59.37.100".
    const char* (*libraries)() = nullptr;
    /// Does what a library does once, by files of its own, before the first foreign byte. May be
    /// null.
    void (*prepare)() = nullptr;
    /// Answers what comes over a socket (wire.hpp), until it is closed. In a process of its own,
    /// which can open no file. `file`: what is decoded, open; or -1.
    void (*serve)(int socket, int file) = nullptr;
};

}  // namespace stx::decoders
