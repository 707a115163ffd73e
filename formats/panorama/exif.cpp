#include "formats/panorama/exif.hpp"

#include <cstring>
#include <optional>
#include <utility>

namespace stx {
namespace {

/// TIFF of a given byte order; what is outside of it reads as nothing.
class TiffBytes {
  public:
    explicit TiffBytes(ByteSpan bytes) : bytes_(bytes) {
        little_ = bytes.size() > 1 && bytes[0] == std::byte{'I'} && bytes[1] == std::byte{'I'};
    }
    [[nodiscard]] std::optional<std::uint32_t> number(std::uint64_t at, int size) const {
        const auto length = static_cast<std::uint64_t>(size);
        if (at > bytes_.size() || bytes_.size() - at < length) return std::nullopt;
        std::uint32_t value = 0;
        for (std::uint64_t i = 0; i < length; ++i) {
            const auto byte =
                std::to_integer<std::uint32_t>(bytes_[at + (little_ ? length - 1 - i : i)]);
            value = value << 8 | byte;
        }
        return value;
    }
    /// Where a tag's entry of 12 bytes is in the directory at `directory`.
    [[nodiscard]] std::optional<std::uint64_t> entry(std::uint64_t directory,
                                                     std::uint32_t tag) const {
        const auto count = number(directory, 2);
        if (!count) return std::nullopt;
        for (std::uint32_t i = 0; i < *count; ++i) {
            const std::uint64_t at = directory + 2 + 12ull * i;
            const auto found = number(at, 2);
            if (!found) return std::nullopt;
            if (*found == tag) return at;
        }
        return std::nullopt;
    }
    /// A SHORT or LONG in its entry.
    [[nodiscard]] std::optional<std::uint32_t> value(std::uint64_t directory,
                                                     std::uint32_t tag) const {
        const auto at = entry(directory, tag);
        if (!at) return std::nullopt;
        const auto type = number(*at + 2, 2);
        if (!type || (*type != 3 && *type != 4)) return std::nullopt;
        return number(*at + 8, *type == 3 ? 2 : 4);
    }

  private:
    ByteSpan bytes_;
    bool little_ = false;
};

constexpr std::uint32_t kOrientation = 0x112, kExifDirectory = 0x8769, kFocal35 = 0xa405;

ExifNotes notesOf(ByteSpan tiff) {
    const TiffBytes t(tiff);
    ExifNotes notes;
    if (t.number(2, 2) != 42u) return notes;
    const auto first = t.number(4, 4);
    if (!first) return notes;
    if (const auto o = t.value(*first, kOrientation); o && *o >= 1 && *o <= 8)
        notes.orientation = static_cast<int>(*o);
    if (const auto directory = t.value(*first, kExifDirectory))
        if (const auto focal = t.value(*directory, kFocal35); focal && *focal < 10000)
            notes.focal35 = *focal;
    return notes;
}

std::uint32_t bigEndian(ByteSpan bytes, std::size_t at, int size) {
    std::uint32_t value = 0;
    for (int i = 0; i < size; ++i)
        value =
            value << 8 | std::to_integer<std::uint32_t>(bytes[at + static_cast<std::size_t>(i)]);
    return value;
}

bool hasText(ByteSpan bytes, std::size_t at, std::string_view text) {
    return bytes.size() >= at + text.size() &&
           std::memcmp(bytes.data() + at, text.data(), text.size()) == 0;
}

/// The TIFF in a JPEG's segment APP1, or in a PNG's chunk eXIf; empty when there is none.
ByteSpan tiffIn(ByteSpan file) {
    if (hasText(file, 0, "\xff\xd8")) {
        for (std::size_t at = 2; at + 4 <= file.size();) {
            if (file[at] != std::byte{0xff}) return {};
            const auto marker = std::to_integer<int>(file[at + 1]);
            if (marker == 0xff) {
                ++at;
                continue;
            }
            const std::size_t size = bigEndian(file, at + 2, 2);
            if (marker == 0xda || size < 2 || file.size() - at - 2 < size) return {};
            constexpr std::string_view kExif("Exif\0\0", 6);
            if (marker == 0xe1 && size > 8 && hasText(file, at + 4, kExif))
                return file.subspan(at + 10, size - 8);
            at += 2 + size;
        }
    } else if (hasText(file, 0, "\x89PNG\r\n\x1a\n")) {
        for (std::size_t at = 8; at + 12 <= file.size();) {
            const std::size_t size = bigEndian(file, at, 4);
            if (file.size() - at - 12 < size) return {};
            if (hasText(file, at + 4, "eXIf")) return file.subspan(at + 8, size);
            at += 12 + size;
        }
    }
    return {};
}

}  // namespace

ExifNotes readExif(ByteSpan file) {
    const ByteSpan tiff = tiffIn(file);
    return tiff.empty() ? ExifNotes{} : notesOf(tiff);
}

Rgba8Image turnedUpright(Rgba8Image picture, int orientation) {
    if (orientation < 2 || orientation > 8) return picture;
    const int w = picture.width(), h = picture.height();
    const bool sideways = orientation >= 5;
    Rgba8Image out(sideways ? h : w, sideways ? w : h);
    for (int y = 0; y < out.height(); ++y)
        for (int x = 0; x < out.width(); ++x) {
            const glm::ivec2 from = [&]() -> glm::ivec2 {
                switch (orientation) {
                    case 2:
                        return {w - 1 - x, y};
                    case 3:
                        return {w - 1 - x, h - 1 - y};
                    case 4:
                        return {x, h - 1 - y};
                    case 5:
                        return {y, x};
                    case 6:
                        return {y, h - 1 - x};
                    case 7:
                        return {w - 1 - y, h - 1 - x};
                    default:
                        return {w - 1 - y, x};
                }
            }();
            out.at(x, y) = picture.at(from.x, from.y);
        }
    return out;
}

}  // namespace stx
