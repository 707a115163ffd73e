#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "formats/files/files.hpp"

namespace stx {

/// Bytes that may be read at any offset: memory, or a file that stays on disk. Cheap to copy; the
/// bytes live as long as any copy. Safe to use from several threads.
class ByteSource {
  public:
    ByteSource() = default;  ///< no bytes

    /// Opens a regular file for reading at offsets; nothing is read yet. Errors (io) when it is
    /// missing, not a regular file, or unreadable.
    [[nodiscard]] static Result<ByteSource> open(const std::filesystem::path& path);
    [[nodiscard]] static ByteSource fromBytes(Bytes bytes);
    [[nodiscard]] static ByteSource fromShared(std::shared_ptr<const Bytes> bytes);

    [[nodiscard]] std::uint64_t size() const;
    /// Fills `out` from `offset`. Errors (invalidInput) when it reaches past the end, and when the
    /// file has changed since it was opened (FileStamp); (io) when reading fails.
    [[nodiscard]] Result<void> read(std::uint64_t offset, std::span<std::byte> out) const;
    /// The bytes themselves where the source is memory, else empty.
    [[nodiscard]] ByteSpan view() const;
    /// Name for error messages; empty for memory.
    [[nodiscard]] const std::string& name() const;
    /// Whether both are copies of one: two openings of a file are not.
    bool operator==(const ByteSource&) const = default;

    struct Impl;

  private:
    std::shared_ptr<const Impl> impl_;
};

/// A part of a source: the bytes of a sample, which are not read before they are asked for.
struct ByteRange {
    ByteSource source;
    std::uint64_t offset = 0;
    std::uint64_t size = 0;

    ByteRange() = default;
    ByteRange(ByteSource s, std::uint64_t o, std::uint64_t n)
        : source(std::move(s)), offset(o), size(n) {}
    /// All of these bytes.
    [[nodiscard]] static ByteRange of(Bytes bytes);

    /// Reads them. Errors as ByteSource::read, and when they are more than limits allow.
    [[nodiscard]] Result<Bytes> load(const Limits& limits) const;
    bool operator==(const ByteRange&) const = default;
};

}  // namespace stx
