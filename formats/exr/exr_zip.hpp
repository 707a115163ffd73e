#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "formats/files/files.hpp"

namespace stx::exr {

/// Scan lines of a chunk of zip compression (OpenEXR file layout, "Scan line blocks").
constexpr int kZipRows = 16;

/// Half floats of every `stride`-th of `from`, as stx::halvesFrom() makes them.
void halvesFrom(const float* from, std::size_t stride, std::span<std::uint16_t> to);

/// The bytes of a chunk as zip compression stores them: even bytes first, then the odd ones, each
/// as the difference from the one before, deflated at `level` (see compressZlib()). `raw` itself
/// when that does not make it smaller, as OpenEXR wants it. Throws std::bad_alloc.
[[nodiscard]] Bytes zipChunk(std::span<const std::uint8_t> raw, int level);

/// The same of a chunk whose bytes are in that order already; they may be changed. Throws
/// std::bad_alloc.
[[nodiscard]] Bytes zipSplitChunk(std::span<std::uint8_t> split, int level);

/// The inverse of halvesFrom(), exact: writes every `stride`-th of `to`.
void floatsFrom(std::span<const std::uint16_t> halves, float* to, std::size_t stride);

/// The inverse of zipChunk(): fills `raw`. False, and anything in `raw`, when the bytes are damaged
/// or hold another number of bytes. Throws std::bad_alloc.
[[nodiscard]] bool unzipChunk(ByteSpan stored, std::span<std::uint8_t> raw);

}  // namespace stx::exr
