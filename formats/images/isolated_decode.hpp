#pragma once

#include <cstdint>

#include "formats/images/codec_table.hpp"

namespace stx {

/// Decodes in a process of its own (fork), for formats whose decoders are known to crash on hostile
/// files: what kills it, or keeps it busy for half a minute, becomes a failure. The request's
/// allocate() is called in both processes. Safe to call from several threads, whose decodings run
/// side by side: no thread of this process ever runs a decoder, so a child finds none of the
/// decoders' locks taken (the C library sees to its own), and it ends by _exit().
[[nodiscard]] bool decodeIsolated(const codecs::Table& table, const codecs::DecodeRequest& request,
                                  std::uint64_t maxMemoryBytes, codecs::Failure& failure);

}  // namespace stx
