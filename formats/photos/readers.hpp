#pragma once

#include "formats/photos/jpeg_segments.hpp"
#include "formats/photos/photo.hpp"
#include "formats/photos/xmp.hpp"

/// One reader for each way to put depth into a photo.
namespace stx::photos {

/// A JPEG with what it tells outside of its picture.
struct JpegPhoto {
    std::shared_ptr<const Bytes> file;
    JpegSegments segments;
    std::optional<Xmp> xmp;            ///< the standard packet
    std::optional<Xmp> extended;       ///< what follows it in other segments
    std::optional<Error> notExtended;  ///< why that cannot be read
    PhotoOptions options;
};

// Each says whether the photo is of its format, and then fills in depth, its code, and what else
// it knows. Errors: of its format, but damaged, or a layout that is not read.
[[nodiscard]] Result<bool> readMpf(const JpegPhoto& jpeg, Photo& photo);
[[nodiscard]] Result<bool> readGDepth(const JpegPhoto& jpeg, Photo& photo, const Limits& limits);
[[nodiscard]] Result<bool> readDynamicDepth(const JpegPhoto& jpeg, Photo& photo);
[[nodiscard]] Result<bool> readSamsung(const JpegPhoto& jpeg, Photo& photo);
[[nodiscard]] Result<bool> readHuawei(const JpegPhoto& jpeg, Photo& photo);

/// A whole HEIF file: its picture, and its depth where there is one.
[[nodiscard]] Result<void> readHeic(Photo& photo, const Limits& limits);

/// What Apple's XMP says of an auxiliary image. False: it is not depth; `subtype` is what it is
/// then, where it says so ("portraiteffectsmatte").
[[nodiscard]] bool readAppleDepth(const Xmp& xmp, glm::ivec2 stored, Photo& photo,
                                  std::string& subtype);

/// An embedded JPEG or PNG, whose header is read. Errors (invalidInput): neither; (unsupported) a
/// lossless JPEG. `what`: "its depth".
[[nodiscard]] Result<PhotoImage> embeddedPicture(ByteSpan bytes, std::shared_ptr<const Bytes> owner,
                                                 std::string_view what);

/// The matte that tells what of a portrait belongs to a person; others are of hair, skin, teeth.
inline constexpr std::string_view kPortraitMatte = "portraiteffectsmatte";

/// The intrinsics of a picture of so many pixels after quarter turns clockwise, or mirrored.
[[nodiscard]] PhotoIntrinsics turned(PhotoIntrinsics k, glm::ivec2 size, int quarters);
[[nodiscard]] PhotoIntrinsics mirrored(PhotoIntrinsics k, glm::ivec2 size, bool leftAndRight);

}  // namespace stx::photos
