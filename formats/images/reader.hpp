#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include "formats/files/files.hpp"
#include "formats/images/images.hpp"

namespace stx {

/// A PNG or JPEG whose header has been read and whose pixels are not decoded yet.
class ImageReader {
  public:
    virtual ~ImageReader() = default;
    /// What read() gives.
    [[nodiscard]] const ImageInfo& info() const { return info_; }
    /// Decodes all pixels, once: rows from the top without gaps, info().channels interleaved values
    /// of info().bits (8 or 16, host order). `values` has room for that. Error (invalidInput):
    /// damaged or cut off; (failed): no memory.
    [[nodiscard]] virtual Result<void> read(void* values) = 0;
    /// True when readRgba8() can be used in place of read().
    [[nodiscard]] virtual bool givesRgba8() const = 0;
    /// The same pixels as 8-bit RGBA: grey spread, missing alpha 255.
    [[nodiscard]] virtual Result<void> readRgba8(glm::u8vec4* pixels) = 0;
    /// What is wrong with pixels that were read though they are damaged (Limits::keepDamaged); else
    /// empty.
    [[nodiscard]] const std::string& damage() const { return damage_; }

  protected:
    ImageInfo info_;
    std::string damage_;
};

/// Readers of bytes that begin as a PNG (libdeflate, else libspng) or JPEG (libjpeg-turbo); `bytes`
/// must outlive them. No memory is taken for pixels before read(). Errors: invalidInput;
/// unsupported for kinds of pixels that the library cannot decode.
[[nodiscard]] Result<std::unique_ptr<ImageReader>> openPng(ByteSpan bytes);
[[nodiscard]] Result<std::unique_ptr<ImageReader>> openJpeg(ByteSpan bytes, const Limits& limits);

/// encodePng() of an image that is taken into memory whole, twice.
[[nodiscard]] Result<Bytes> encodeWholePng(int width, int height, int channels, int bits,
                                           const void* values, bool srgb, int level);

/// Checks a header before memory is taken for its pixels. Error (invalidInput) when a size is below
/// 1 or beyond the limits, or when there are more pixels than `fileBytes` bytes of such a file can
/// hold, whatever is in them.
[[nodiscard]] Result<void> checkImageHeader(const ImageInfo& info, std::size_t fileBytes,
                                            const Limits& limits);
/// Error (failed) unless each side has 1 to 65535 pixels. `kind`: "PNG" or "JPEG".
[[nodiscard]] Result<void> checkEncodable(int width, int height, std::string_view kind);

}  // namespace stx
