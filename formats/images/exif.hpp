#pragma once

#include <cstdint>

#include "formats/files/files.hpp"
#include "formats/images/images.hpp"
#include "lib/base/image.hpp"

namespace stx {

/// What a camera wrote into a picture, and panoramas and photographs with depth need.
struct ExifNotes {
    /// How to turn the stored picture: 1 = not at all, 3 = by half a turn, 6 = clockwise, 8 =
    /// counter-clockwise, 2, 4, 5 and 7 = these mirrored (EXIF 2.3, tag 274).
    int orientation = 1;
    bool oriented = false;  ///< the file has that tag
    double focal35 = 0;  ///< focal length of a 36x24 mm camera with the same diagonal, mm; 0 = none

    /// Of what the tags say; what they cannot say changes nothing.
    void setOrientation(std::uint64_t said) {
        if (said < 1 || said > 8) return;
        orientation = static_cast<int>(said);
        oriented = true;
    }
    void setFocal35(std::uint64_t said) {
        if (said < 10000) focal35 = static_cast<double>(said);
    }
};

/// EXIF of a JPEG (APP1), a PNG (eXIf) or a TIFF (its own tags, of which orientation 1 counts as
/// not there); the defaults where there is none, or a damaged one.
[[nodiscard]] ExifNotes readExif(ByteSpan file);
/// The same of the TIFF alone that such a segment holds.
[[nodiscard]] ExifNotes readExifTiff(ByteSpan tiff);

/// Columns and rows of a TIFF's first picture as it is stored; 0 of other files.
[[nodiscard]] glm::ivec2 storedSizeOfTiff(ByteSpan file);

/// The picture turned as its EXIF orientation says.
template <class T>
[[nodiscard]] Image<T> turnedUpright(Image<T> picture, int orientation) {
    if (orientation < 2 || orientation > 8) return picture;
    const int w = picture.width(), h = picture.height();
    const bool sideways = orientation >= 5;
    const bool fromRight = orientation == 2 || orientation == 3 || orientation >= 7;
    const bool fromBelow =
        orientation == 3 || orientation == 4 || orientation == 6 || orientation == 7;
    Image<T> out(sideways ? h : w, sideways ? w : h);
    for (int y = 0; y < out.height(); ++y)
        for (int x = 0; x < out.width(); ++x) {
            const int column = sideways ? y : x, row = sideways ? x : y;
            out.at(x, y) =
                picture.at(fromRight ? w - 1 - column : column, fromBelow ? h - 1 - row : row);
        }
    return out;
}

}  // namespace stx
