#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "lib/base/job.hpp"

namespace stx {

/// Bytes that a zlib stream of `size` bytes may take at most.
[[nodiscard]] std::size_t zlibBound(std::size_t size);

/// A zlib stream (RFC 1950) of all of `from` in `to`; its size, 0 when it does not fit. `level` is
/// 0 (stored) to 12; 1 is ISA-L's where the build has it, which takes a third of libdeflate's time
/// for 2 % more bytes, all others are libdeflate's. The same bytes in each run. Throws
/// std::bad_alloc.
[[nodiscard]] std::size_t compressZlib(std::span<const std::byte> from, int level,
                                       std::span<std::byte> to);

/// The inverse of compressZlib(): fills all of `to` with what a zlib stream holds, by libdeflate.
/// False, and anything in `to`, when the stream is damaged or holds another number of bytes. Throws
/// std::bad_alloc.
[[nodiscard]] bool inflateZlib(std::span<const std::byte> from, std::span<std::byte> to);

/// A gzip file (RFC 1952) of all of `from`, without a name and a time, by libdeflate: the same
/// bytes in each run. Throws std::bad_alloc.
[[nodiscard]] std::vector<std::byte> compressGzip(std::span<const std::byte> from, int level);

/// What a gzip file (RFC 1952) of one or more members holds. Errors (invalidInput): damaged; more
/// than the limits allow.
[[nodiscard]] Result<std::vector<std::byte>> gunzip(std::span<const std::byte> from,
                                                    const Limits& limits);
/// The bytes begin as a gzip file does.
[[nodiscard]] bool isGzip(std::span<const std::byte> bytes);

}  // namespace stx
