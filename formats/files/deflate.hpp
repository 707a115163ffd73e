#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

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

/// The size that a gzip file's last bytes say its content has, modulo 2^32; nothing where `from` is
/// not gzip or says more than its bytes can hold.
[[nodiscard]] std::optional<std::size_t> gzipContentSize(std::span<const std::byte> from);

/// inflateZlib() of a gzip file's first member.
[[nodiscard]] bool inflateGzip(std::span<const std::byte> from, std::span<std::byte> to);

}  // namespace stx
