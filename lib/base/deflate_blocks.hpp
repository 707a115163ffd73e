#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

/// A deflate stream (RFC 1951) block by block, for those who know more of their bytes than a
/// compressor finds out.
namespace stx::deflate {

constexpr int kSymbols = 286;   ///< literals, the end of a block, and sizes of repeats
constexpr int kDistances = 30;  ///< codes of distances
/// The farthest that a repeat may look back, bytes.
constexpr std::uint32_t kWindow = 32768;
/// The smallest repeat, bytes.
constexpr std::uint32_t kLeastRepeat = 3;
/// Bits of the longest code word here; four of them are written at once. Deflate has room for 15.
constexpr int kLongestWord = 14;

/// How often the symbols of a block are expected, on any scale.
struct Counts {
    std::array<std::uint32_t, kSymbols> symbols{};
    std::array<std::uint32_t, kDistances> distances{};

    /// A repeat of `size` bytes, any number from kLeastRepeat on, by `weight`.
    void addRepeat(std::uint32_t size, std::uint32_t distance, std::uint32_t weight);
};

/// Huffman codes of a block's symbols, and the bits that tell them to the reader.
class Codes {
  public:
    struct Word {
        std::uint16_t bits = 0;  ///< the first one lowest
        std::uint8_t size = 0;   ///< 0: the symbol has no word
    };

    /// Symbols that are expected 0 times have no word; the block's end has one always.
    explicit Codes(Counts counts);
    /// Those of clause 3.2.6, which need no telling.
    [[nodiscard]] static const Codes& fixed();

    [[nodiscard]] int literalBits(std::uint8_t byte) const { return symbols_[byte].size; }
    [[nodiscard]] int repeatBits(std::uint32_t size, std::uint32_t distance) const;
    /// Of what stands before and behind a block's symbols.
    [[nodiscard]] int blockBits() const { return headBits_ + symbols_[256].size; }

  private:
    friend class BlockWriter;
    Codes() = default;
    void writeHead();

    std::array<Word, kSymbols> symbols_{};
    std::array<Word, kDistances> distances_{};
    std::array<std::uint8_t, 384> head_{};  ///< the block's first bits
    int headBits_ = 0;
};

/// Writes without looking how much room there is: a literal takes up to kLongestWord bits, a repeat
/// of up to 258 bytes 46, a block up to 320 bytes more; and 16 bytes behind the end are touched.
class BlockWriter {
  public:
    explicit BlockWriter(std::uint8_t* to) : begin_(to), at_(to) {}

    /// The two bytes before the first block of a zlib stream (RFC 1950).
    void zlibHead() { put(0x0178, 16); }
    /// Blocks of bytes as they are.
    void stored(std::span<const std::uint8_t> bytes);
    /// A block of literals and repeats goes on until end(). `codes` must live until then.
    void begin(const Codes& codes);
    void literals(std::span<const std::uint8_t> bytes);
    /// `size` of any number from kLeastRepeat on.
    void repeat(std::uint32_t size, std::uint32_t distance);
    void end();
    /// The last block, an empty one, and the sum of all bytes (libdeflate_adler32()). The size of
    /// the stream.
    [[nodiscard]] std::size_t finishZlib(std::uint32_t adler);

  private:
    friend class Codes;
    /// `count` is 0 to 57.
    void put(std::uint64_t bits, int count) {
        held_ |= bits << count_;
        count_ += count;
        flush();
    }
    void flush() {
        std::memcpy(at_, &held_, sizeof held_);
        at_ += count_ >> 3;
        held_ >>= count_ & ~7;
        count_ &= 7;
    }
    void toByte();

    std::uint8_t* begin_;
    std::uint8_t* at_;
    const Codes* codes_ = nullptr;
    std::uint64_t held_ = 0;  ///< bits that make no byte yet
    int count_ = 0;           ///< of them, up to 7 between calls
};

}  // namespace stx::deflate
