#pragma once

#include "formats/files/files.hpp"
#include "lib/model/texture.hpp"

namespace stx {

/// What a camera wrote into a picture and a panorama needs.
struct ExifNotes {
    /// How to turn the stored picture: 1 = not at all, 3 = by half a turn, 6 = clockwise, 8 =
    /// counter-clockwise, 2, 4, 5 and 7 = these mirrored (EXIF 2.3, tag 274).
    int orientation = 1;
    double focal35 = 0;  ///< focal length of a 36x24 mm camera with the same diagonal, mm; 0 = none
};

/// EXIF of a JPEG (APP1) or a PNG (eXIf); the defaults where there is none, or a damaged one.
[[nodiscard]] ExifNotes readExif(ByteSpan file);

/// The picture turned as its EXIF orientation says.
[[nodiscard]] Rgba8Image turnedUpright(Rgba8Image picture, int orientation);

}  // namespace stx
