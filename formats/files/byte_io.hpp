#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "formats/files/files.hpp"

namespace stx {

/// The number at a place, most significant byte first; `at + count <= bytes.size()`, count <= 4.
inline std::uint32_t bigEndian(ByteSpan bytes, std::size_t at, std::size_t count) {
    std::uint32_t value = 0;
    for (const std::byte b : bytes.subspan(at, count))
        value = value << 8 | std::to_integer<std::uint32_t>(b);
    return value;
}

/// Whether that text is at a place, which may be past the end.
inline bool hasText(ByteSpan bytes, std::size_t at, std::string_view text) {
    if (at > bytes.size() || bytes.size() - at < text.size()) return false;
    return std::string_view(reinterpret_cast<const char*>(bytes.data()) + at, text.size()) == text;
}

/// Reads big-endian numbers. Past the end it gives zeros and remembers that it failed.
class ByteReader {
  public:
    ByteReader() = default;
    /// `base` is added to offset(), for messages.
    explicit ByteReader(ByteSpan bytes, std::uint64_t base = 0) : bytes_(bytes), base_(base) {}

    std::uint8_t u8() { return static_cast<std::uint8_t>(number(1)); }
    std::uint16_t u16() { return static_cast<std::uint16_t>(number(2)); }
    std::uint32_t u24() { return static_cast<std::uint32_t>(number(3)); }
    std::uint32_t u32() { return static_cast<std::uint32_t>(number(4)); }
    std::uint64_t u64() { return number(8); }
    void skip(std::size_t count) { take(count); }
    std::string text(std::size_t length) {
        const ByteSpan part = take(length);
        return {reinterpret_cast<const char*>(part.data()), part.size()};
    }
    /// The next `length` bytes as a reader of their own; `length` <= left().
    ByteReader sub(std::size_t length) {
        const std::uint64_t at = offset();
        return ByteReader(take(length), at);
    }
    /// What is left, copied.
    [[nodiscard]] Bytes rest() const {
        return {bytes_.begin() + static_cast<std::ptrdiff_t>(at_), bytes_.end()};
    }
    [[nodiscard]] ByteSpan restView() const { return bytes_.subspan(at_); }

    [[nodiscard]] std::size_t left() const { return bytes_.size() - at_; }
    [[nodiscard]] std::uint64_t offset() const { return base_ + at_; }
    [[nodiscard]] bool failed() const { return failed_; }

  private:
    ByteSpan take(std::size_t count) {
        if (count > left()) {
            failed_ = true;
            at_ = bytes_.size();
            return {};
        }
        const ByteSpan part = bytes_.subspan(at_, count);
        at_ += count;
        return part;
    }
    std::uint64_t number(std::size_t count) {
        std::uint64_t value = 0;
        for (const std::byte b : take(count))
            value = value << 8 | std::to_integer<std::uint64_t>(b);
        return value;
    }

    ByteSpan bytes_;
    std::uint64_t base_ = 0;
    std::size_t at_ = 0;
    bool failed_ = false;
};

/// Writes big-endian numbers.
class ByteWriter {
  public:
    void u8(std::uint8_t value) { number(value, 1); }
    void u16(std::uint16_t value) { number(value, 2); }
    void u24(std::uint32_t value) { number(value, 3); }
    void u32(std::uint32_t value) { number(value, 4); }
    void u64(std::uint64_t value) { number(value, 8); }
    void zeros(std::size_t count) { bytes_.resize(bytes_.size() + count); }
    void text(std::string_view value) { bytes(std::as_bytes(std::span(value))); }
    void bytes(ByteSpan value) { bytes_.insert(bytes_.end(), value.begin(), value.end()); }
    /// Overwrites a number written before.
    void patch32(std::size_t at, std::uint32_t value) {
        for (int i = 0; i < 4; ++i)
            bytes_[at + static_cast<std::size_t>(i)] =
                static_cast<std::byte>(value >> (24 - 8 * i));
    }

    [[nodiscard]] std::size_t size() const { return bytes_.size(); }
    [[nodiscard]] ByteSpan view() const { return bytes_; }
    [[nodiscard]] Bytes take() { return std::move(bytes_); }

  private:
    void number(std::uint64_t value, int count) {
        for (int i = count - 1; i >= 0; --i)
            bytes_.push_back(static_cast<std::byte>(value >> (8 * i) & 0xFF));
    }
    Bytes bytes_;
};

}  // namespace stx
