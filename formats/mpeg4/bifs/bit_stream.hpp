#pragma once

#include <bit>
#include <cstdint>

#include "formats/files/files.hpp"

namespace stx::mpeg4 {

/// Reads bits, most significant first. Past the end it gives zeros and remembers that it failed.
class BitReader {
  public:
    explicit BitReader(ByteSpan bytes) : bytes_(bytes), end_(std::uint64_t{bytes.size()} * 8) {}

    /// 0 to 32 bits.
    std::uint32_t read(int bits) {
        if (static_cast<std::uint64_t>(bits) > end_ - position_) {
            position_ = end_;
            failed_ = true;
            return 0;
        }
        std::uint64_t window = 0;
        const std::size_t first = static_cast<std::size_t>(position_ >> 3);
        const int offset = static_cast<int>(position_ & 7);
        const int bytesNeeded = (offset + bits + 7) / 8;  // at most 5
        for (int i = 0; i < bytesNeeded; ++i)
            window = window << 8 |
                     std::to_integer<std::uint64_t>(bytes_[first + static_cast<std::size_t>(i)]);
        position_ += static_cast<std::uint64_t>(bits);
        const std::uint64_t mask = (std::uint64_t{1} << bits) - 1;
        return static_cast<std::uint32_t>(window >> (bytesNeeded * 8 - offset - bits) & mask);
    }
    bool flag() { return read(1) != 0; }
    std::uint64_t read64() {
        const std::uint64_t high = read(32);
        return high << 32 | read(32);
    }

    [[nodiscard]] std::uint64_t position() const { return position_; }
    [[nodiscard]] std::uint64_t left() const { return end_ - position_; }
    [[nodiscard]] bool failed() const { return failed_; }

  private:
    ByteSpan bytes_;
    std::uint64_t end_;
    std::uint64_t position_ = 0;
    bool failed_ = false;
};

/// Writes bits, most significant first; the last byte is filled with zeros.
class BitWriter {
  public:
    /// The lowest `bits` (0 to 32) of `value`.
    void write(std::uint32_t value, int bits) {
        window_ = window_ << bits | (value & ((std::uint64_t{1} << bits) - 1));
        held_ += bits;
        while (held_ >= 8) {
            held_ -= 8;
            bytes_.push_back(static_cast<std::byte>(window_ >> held_ & 0xFF));
        }
    }
    void flag(bool value) { write(value ? 1 : 0, 1); }
    void write64(std::uint64_t value) {
        write(static_cast<std::uint32_t>(value >> 32), 32);
        write(static_cast<std::uint32_t>(value), 32);
    }
    /// The bits of another writer.
    void append(const BitWriter& other) {
        for (const std::byte b : other.bytes_) write(std::to_integer<std::uint32_t>(b), 8);
        if (other.held_ > 0) write(static_cast<std::uint32_t>(other.window_), other.held_);
    }
    /// All bytes so far, the last one filled up.
    [[nodiscard]] Bytes finish() {
        if (held_ > 0) write(0, 8 - held_);
        return std::move(bytes_);
    }

  private:
    Bytes bytes_;
    std::uint64_t window_ = 0;
    int held_ = 0;
};

/// Bits that a number needs; 0 for 0.
[[nodiscard]] inline int significantBits(std::uint64_t value) {
    return static_cast<int>(std::bit_width(value));
}

}  // namespace stx::mpeg4
