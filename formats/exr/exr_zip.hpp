#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "formats/files/files.hpp"

namespace stx::exr {

/// Scan lines of a chunk of zip compression (OpenEXR file layout, "Scan line blocks").
constexpr int kZipRows = 16;

/// Half floats of every `stride`-th of `from`, rounded to the nearest, ties to even; beyond their
/// range infinity. The same as Imath's half, except for the bits of NaN.
void halvesFrom(const float* from, std::size_t stride, std::span<std::uint16_t> to);

/// A chunk as zip compression stores it: its bytes, split and subtracted as splitAndSubtract()
/// does, deflated at `level` (see compressZlib()); joined again where that does not make them
/// smaller, as OpenEXR wants it. `split` may be changed. Throws std::bad_alloc.
[[nodiscard]] Bytes zipChunk(std::span<std::uint8_t> split, int level);

/// The inverse of halvesFrom(), exact: writes every `stride`-th of `to`.
void floatsFrom(std::span<const std::uint16_t> halves, float* to, std::size_t stride);

/// The inverse of splitAndSubtract() and zipChunk(): fills `raw`. False, and anything in `raw`,
/// when the bytes are damaged or hold another number of bytes. Throws std::bad_alloc.
[[nodiscard]] bool unzipChunk(ByteSpan stored, std::span<std::uint8_t> raw);

}  // namespace stx::exr
