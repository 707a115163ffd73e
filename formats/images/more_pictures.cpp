#include "formats/images/more_pictures.hpp"

#include <string>

#include "formats/files/byte_io.hpp"
#include "formats/images/tiff_numbers.hpp"
#include "formats/images/webp_chunks.hpp"

namespace stx {
namespace {

std::size_t byteOf(ByteSpan file, std::size_t at) {
    return at < file.size() ? std::to_integer<std::size_t>(file[at]) : 0;
}

/// Directories that are no smaller copies (thumbnails) and no masks of another.
bool tiffHasMore(ByteSpan file, const TiffLayout& layout) {
    constexpr std::uint64_t kSubfileType = 254, kReducedOrMask = 1 | 4;
    constexpr int kMostDirectories = 64;  // directories can point in a circle
    const TiffNumbers numbers(file);
    std::uint64_t directory = numbers.at(layout.start, layout.offset);
    for (int i = 0; i < kMostDirectories; ++i) {
        const std::uint64_t count = numbers.at(directory, layout.count);
        if (count > file.size() / layout.entry) return false;
        directory = numbers.at(directory + layout.count + count * layout.entry, layout.offset);
        if (directory == 0 || directory >= file.size()) return false;
        const auto kind = findTiffEntry(numbers, layout, directory, kSubfileType);
        if (!kind || (kind->number & kReducedOrMask) == 0) return true;
    }
    return false;
}

/// GIF89a, 17 to 27: blocks that begin with what they are.
bool gifHasMore(ByteSpan file) {
    const auto tableBytes = [&](std::size_t packedAt) {
        const std::size_t packed = byteOf(file, packedAt);
        return packed & 0x80 ? std::size_t{3} << ((packed & 7) + 1) : 0;
    };
    int pictures = 0;
    for (std::size_t at = 13 + tableBytes(10); at < file.size();) {
        const std::size_t kind = byteOf(file, at);
        if (kind == 0x2C) {
            if (++pictures > 1) return true;
            at += 10 + tableBytes(at + 9) + 1;
        } else if (kind == 0x21) {
            at += 2;
        } else {
            return false;
        }
        while (byteOf(file, at) > 0) at += 1 + byteOf(file, at);
        ++at;
    }
    return false;
}

/// An animation has its frames in chunks.
bool webpHasMore(ByteSpan file) {
    int frames = 0;
    eachWebpChunk(file, "ANMF", [&](ByteSpan) { return ++frames > 1; });
    return frames > 1;
}

/// acTL, which is before the pixels, has the number of frames.
bool pngHasMore(ByteSpan file) {
    for (std::size_t at = 8; at + 12 <= file.size();) {
        if (hasText(file, at + 4, "IDAT")) return false;
        if (hasText(file, at + 4, "acTL")) return bigEndian(file, at + 8, 4) > 1;
        at += 12 + bigEndian(file, at, 4);
    }
    return false;
}

}  // namespace

bool holdsMorePictures(ByteSpan file) {
    if (const TiffLayout* layout = tiffLayoutOf(file)) return tiffHasMore(file, *layout);
    if (hasText(file, 0, "GIF8")) return gifHasMore(file);
    if (isWebp(file)) return webpHasMore(file);
    return hasText(file, 0, "\x89PNG\r\n\x1a\n") && pngHasMore(file);
}

void noteMorePictures(ByteSpan file, std::string_view name, Job& job) {
    if (holdsMorePictures(file))
        job.noteOnce(fmt::format("'{}' holds more than one picture; the first is taken", name));
}

}  // namespace stx
