#pragma once

#include <functional>

#include "formats/images/codec_table.hpp"

namespace stx {

/// Decodes in a process of its own (fork), for formats whose decoders are known to crash on hostile
/// files: what kills it, or keeps it busy for half a minute, becomes a failure. The request's
/// allocate() is called in both processes. The caller sees to it that no other thread is inside the
/// codecs meanwhile.
[[nodiscard]] bool decodeIsolated(const codecs::Table& table, const codecs::DecodeRequest& request,
                                  std::uint64_t maxMemoryBytes, codecs::Failure& failure);

}  // namespace stx
