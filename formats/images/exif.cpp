#include "formats/images/exif.hpp"

#include <libexif/exif-data.h>

#include <algorithm>
#include <memory>
#include <span>
#include <string_view>

#include "formats/files/byte_io.hpp"
#include "formats/images/images.hpp"
#include "formats/images/tiff_numbers.hpp"
#include "formats/images/webp_chunks.hpp"

namespace stx {
namespace {

constexpr std::string_view kHeader("Exif\0\0", 6);

struct FreeExif {
    void operator()(ExifData* data) const { exif_data_unref(data); }
};

/// A number in an entry; 0 when it is not there or not one.
std::uint32_t numberOf(ExifData* data, ExifIfd directory, ExifTag tag) {
    const ExifEntry* entry = exif_content_get_entry(data->ifd[directory], tag);
    if (!entry || entry->components < 1) return 0;
    const ExifByteOrder order = exif_data_get_byte_order(data);
    if (entry->format == EXIF_FORMAT_SHORT) return exif_get_short(entry->data, order);
    if (entry->format == EXIF_FORMAT_LONG) return exif_get_long(entry->data, order);
    return 0;
}

/// `exif`: kHeader, and a TIFF.
ExifNotes notesOf(ByteSpan exif) {
    const std::unique_ptr<ExifData, FreeExif> data(exif_data_new());
    ExifNotes notes;
    if (!data) return notes;
    // What the library thinks should be there is not what the camera wrote.
    exif_data_unset_option(data.get(), EXIF_DATA_OPTION_FOLLOW_SPECIFICATION);
    exif_data_load_data(data.get(), reinterpret_cast<const unsigned char*>(exif.data()),
                        static_cast<unsigned>(exif.size()));
    notes.setOrientation(numberOf(data.get(), EXIF_IFD_0, EXIF_TAG_ORIENTATION));
    notes.setFocal35(numberOf(data.get(), EXIF_IFD_EXIF, EXIF_TAG_FOCAL_LENGTH_IN_35MM_FILM));
    return notes;
}

/// Of a picture that is a TIFF itself.
ExifNotes notesOfTiff(ByteSpan file, const TiffLayout& layout) {
    const TiffNumbers numbers(file);
    const auto numberOf = [&](std::uint64_t directory, ExifTag tag) {
        const auto entry = findTiffEntry(numbers, layout, directory, tag);
        return entry ? entry->number : 0;
    };
    const std::uint64_t first = numbers.at(layout.start, layout.offset);
    ExifNotes notes;
    notes.setOrientation(numberOf(first, EXIF_TAG_ORIENTATION));
    // Programs write 1 without looking; it is what a TIFF without the tag means, too.
    notes.oriented = notes.orientation != 1;
    if (const std::uint64_t exif = numberOf(first, EXIF_TAG_EXIF_IFD_POINTER); exif != 0)
        notes.setFocal35(numberOf(exif, EXIF_TAG_FOCAL_LENGTH_IN_35MM_FILM));
    return notes;
}

/// The TIFF of a JPEG's segment APP1, of a PNG's chunk eXIf or a WebP's EXIF; else empty.
ByteSpan exifIn(ByteSpan file) {
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
            if (marker == 0xe1 && size > 8 && hasText(file, at + 4, kHeader))
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
    } else if (isWebp(file)) {
        ByteSpan exif;
        eachWebpChunk(file, "EXIF", [&](ByteSpan body) {
            // Some write the header of a JPEG's, too.
            exif = hasText(body, 0, kHeader) ? body.subspan(kHeader.size()) : body;
            return !exif.empty();
        });
        return exif;
    }
    return {};
}

}  // namespace

ExifNotes readExif(ByteSpan file) {
    // Pixels come first in many: libexif reads the first 64 KiB.
    if (const TiffLayout* layout = tiffLayoutOf(file)) return notesOfTiff(file, *layout);
    return readExifTiff(exifIn(file));
}

glm::ivec2 storedSizeOfTiff(ByteSpan file) {
    constexpr std::uint64_t kWidth = 256, kHeight = 257;
    const TiffLayout* const layout = tiffLayoutOf(file);
    if (!layout) return {0, 0};
    const TiffNumbers numbers(file);
    const std::uint64_t first = numbers.at(layout->start, layout->offset);
    const auto width = findTiffEntry(numbers, *layout, first, kWidth);
    const auto height = findTiffEntry(numbers, *layout, first, kHeight);
    if (!width || !height || std::max(width->number, height->number) > INT32_MAX) return {0, 0};
    return {static_cast<int>(width->number), static_cast<int>(height->number)};
}

ExifNotes readExifTiff(ByteSpan tiff) {
    if (tiff.empty()) return {};
    const auto header = std::as_bytes(std::span(kHeader));
    Bytes exif(header.begin(), header.end());
    exif.insert(exif.end(), tiff.begin(), tiff.end());
    return notesOf(exif);
}

}  // namespace stx
