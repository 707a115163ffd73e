#pragma once

#include <string>
#include <string_view>

#include "formats/images/images.hpp"
#include "lib/model/texture.hpp"

namespace stx::photos {

/// What the file of a picture says of its colours, as an ICC profile: that of a JPEG, TIFF, WebP or
/// PNG; or made of the numbers that a PNG has in its place (cICP before iCCP, sRGB, gAMA with cHRM;
/// PNG, third edition, 4.3). Empty: nothing, or sRGB.
struct FileColours {
    Bytes profile;
    std::string note;  ///< of what it says and nobody here converts
};
[[nodiscard]] FileColours coloursOf(ByteSpan file);
/// The same of codes of ITU-T H.273 (tables 2 and 3), as PNG's cICP and HEIF's nclx have them.
[[nodiscard]] FileColours coloursOfCodes(unsigned primaries, unsigned transfer);

/// Makes sRGB of a picture by what its file says; gives the note of fileToSrgb().
[[nodiscard]] std::string madeSrgb(Rgba8Image& picture, const FileColours& colours);
/// Makes sRGB of a decoded picture by what its file says. `note` is what was done, or not; empty
/// where the colours are sRGB already.
void fileToSrgb(Rgba8Image& picture, ByteSpan file, std::string& note);
/// rgba8From() as sRGB; more than 8 bits are rounded behind the conversion. Linear
/// light stays as it is.
[[nodiscard]] Rgba8Image srgb8From(const DecodedImage& image, ByteSpan file, std::string& note,
                                   Rgba8Loss* loss = nullptr);
/// The picture of a file, HEIC too, as viewers show it: 8-bit sRGB, turned as its EXIF says (HEIC:
/// its own properties). `name` is for messages; `note` is as of fileToSrgb(); what is lost is added
/// to `loss`, where that is given. Errors: those of decodeImage(), of HEIC of openPhoto() and
/// decodeColour().
[[nodiscard]] Result<Rgba8Image> decodeAsShown(ByteSpan file, std::string_view name,
                                               const Limits& limits, std::string& note,
                                               Rgba8Loss* loss = nullptr);
/// rgbaFloatFrom() as coded sRGB of 0 to 1. Linear light stays as it is.
[[nodiscard]] RgbaFloatImage srgbFloatFrom(const DecodedImage& image, ByteSpan file,
                                           std::string& note);

}  // namespace stx::photos
