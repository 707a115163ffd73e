#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace stx {

/// One channel's share of a row in a chunk of OpenEXR whose bytes are split: low bytes of its
/// 16-bit words in the first half of the chunk, high bytes in the second.
struct RowPart {
    std::uint32_t bytes = 0;
    /// Bytes after which values of one size follow each other: 1 of halves, 2 of floats.
    std::uint32_t period = 1;
    /// An earlier part whose words are the same in all rows; -1 = none.
    int same = -1;
};

/// Rows from this width on, pixels, are packed by packRows(); what narrow ones have in common is
/// little beside what tells it.
constexpr int kPackedWidth = 700;

/// Bytes of the largest chunk that is packed.
constexpr std::size_t kLargestPacked = std::size_t{1} << 26;

/// Bytes that packRows() may touch for a chunk of `size`.
[[nodiscard]] constexpr std::size_t packedRoom(std::size_t size) {
    // No literal takes more than 14 bits and no repeat of eight bytes more than 46; a block's own
    // codes are told for 1200 literals, or where that is less than 9 bits for each; 48 stored
    // bytes between two blocks take eight more.
    return 2 * size + 512;
}

/// A zlib stream of a chunk whose bytes are in the order of splitAndSubtract(): `rows` times
/// `parts` of low bytes, then as many of high ones. Faster than a general compressor: it knows
/// which parts are the same, finds runs, and decides once for each channel of a chunk whether its
/// bytes are worth a code; those that are not (low bytes of colours, depth) are stored as they
/// are. `adler` is the Adler-32 of all bytes. The size of the stream; `to` has packedRoom() of
/// them. Throws std::bad_alloc.
[[nodiscard]] std::size_t packRows(std::span<const std::uint8_t> split, int rows,
                                   std::span<const RowPart> parts, std::uint32_t adler,
                                   std::uint8_t* to);

}  // namespace stx
