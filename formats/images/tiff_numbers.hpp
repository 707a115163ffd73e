#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace stx {

/// Numbers of a TIFF of either order of bytes; 0 past the end.
class TiffNumbers {
  public:
    explicit TiffNumbers(std::span<const std::byte> file)
        : file_(file), little_(!file.empty() && file[0] == std::byte{'I'}) {}
    [[nodiscard]] std::uint64_t at(std::uint64_t offset, std::size_t bytes) const {
        std::uint64_t value = 0;
        for (std::size_t i = 0; i < bytes; ++i) {
            const std::uint64_t from = offset + (little_ ? bytes - 1 - i : i);
            value = value << 8 |
                    (from < file_.size() ? std::to_integer<std::uint64_t>(file_[from]) : 0u);
        }
        return value;
    }
    void write(std::byte* to, std::uint64_t value, std::size_t bytes) const {
        for (std::size_t i = 0; i < bytes; ++i)
            to[i] = static_cast<std::byte>(value >> 8 * (little_ ? i : bytes - 1 - i));
    }
    [[nodiscard]] std::size_t size() const { return file_.size(); }

  private:
    std::span<const std::byte> file_;
    bool little_;
};

/// Sizes of what a directory is made of, in bytes.
struct TiffLayout {
    std::size_t start, count, entry, offset;  ///< of its place in the header, of its fields
    /// Of a value in an entry, behind tag, type and count.
    [[nodiscard]] std::size_t valueAt() const { return 4 + offset; }
};

/// Of TIFF or BigTIFF; null where the file is neither.
[[nodiscard]] inline const TiffLayout* tiffLayoutOf(std::span<const std::byte> file) {
    static constexpr TiffLayout kClassic = {4, 2, 12, 4}, kBig = {8, 8, 20, 8};
    if (file.size() < 8 || file[0] != file[1] ||
        (file[0] != std::byte{'I'} && file[0] != std::byte{'M'}))
        return nullptr;
    const std::uint64_t version = TiffNumbers(file).at(2, 2);
    return version == 42 ? &kClassic : version == 43 ? &kBig : nullptr;
}

/// What an entry of a directory says.
struct TiffEntry {
    std::uint64_t count = 0;   ///< of values
    std::uint64_t number = 0;  ///< the value, of one SHORT or LONG; else where values are
};

/// The entry of that tag in the directory at that byte.
[[nodiscard]] inline std::optional<TiffEntry> findTiffEntry(const TiffNumbers& file,
                                                            const TiffLayout& layout,
                                                            std::uint64_t directory,
                                                            std::uint64_t tag) {
    constexpr std::uint64_t kShort = 3, kLong = 4;
    if (directory >= file.size()) return {};
    const std::uint64_t count = file.at(directory, layout.count);
    for (std::uint64_t i = 0; i < count && i < file.size() / layout.entry; ++i) {
        const std::uint64_t entry = directory + layout.count + i * layout.entry;
        if (file.at(entry, 2) != tag) continue;
        const std::uint64_t type = file.at(entry + 2, 2);
        const std::uint64_t values = file.at(entry + 4, layout.offset);
        const std::size_t bytes = values != 1      ? layout.offset
                                  : type == kShort ? 2
                                  : type == kLong  ? 4
                                                   : layout.offset;
        return TiffEntry{values, file.at(entry + layout.valueAt(), bytes)};
    }
    return {};
}

}  // namespace stx
