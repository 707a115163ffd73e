#pragma once

#include <cstdint>
#include <filesystem>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <glm/glm.hpp>

#include "formats/files/files.hpp"
#include "lib/base/image.hpp"
#include "lib/base/job.hpp"

namespace stx {

/// What an image file's header says, read without any codec.
struct ImageInfo {
    std::string format;  ///< "png", "jpeg", "exr", "other"
    int width = 0, height = 0;
    int channels = 0;  ///< as decoded: 1 grey, 2 grey+alpha, 3 RGB, 4 RGBA; palettes are spread
    int bits = 0;      ///< per channel as decoded: 8 or 16 (JPEG: 8 or 12)
    /// Of a stored value where that is less: PNG's grey of 1, 2 or 4 bits is spread to 8 by
    /// decoding, code 1 of 4 bits becomes 17; else 0.
    int greyBits = 0;
};

/// Header of a PNG or JPEG (others: error unsupported). Loads no library; a few microseconds.
[[nodiscard]] Result<ImageInfo> probeImage(ByteSpan bytes);

/// A decoded picture: interleaved channels, row 0 on top, values exactly as the file has them (no
/// colour conversion, alpha straight as stored).
struct DecodedImage {
    int width = 0, height = 0, channels = 0;
    std::variant<std::vector<std::uint8_t>, std::vector<std::uint16_t>, std::vector<float>> values;
    /// Of integers that do not reach to their largest value (video of 10 bits): the bits that they
    /// have; else 0.
    int usedBits = 0;
    /// Of integers that decoding stretched to all of `values` (grey of 4 bits, a PGM up to 1000, a
    /// TIFF of 32 bits, whose values are floats of -1 to 1): the largest that the file can have;
    /// else 0.
    double storedLargest = 0;
    std::vector<std::string> channelNames;  ///< "R", "G", "B", "A", "Y", "Z", …
    bool linear = false;                    ///< float formats (EXR, HDR): linear light
    /// Of linear colours whose primaries are not those of Rec. 709: what these are multiplied with
    /// to be so, by toRec709() of those who take the picture for colours.
    std::optional<glm::dmat3> rec709FromRgb;
    std::string coloursNote;     ///< what is done about such primaries, or factors of light
    std::string colourNote;      ///< of colours of video that are not converted, for a person
    bool premultiplied = false;  ///< there is alpha, and colours hold it (EXR, TIFF)
    /// Where the stored pixels (EXR: the data window) lie in the picture (the display window), and
    /// the size of that. decodeImage() gives the picture: 0, 0 and the image's own size.
    int originX = 0, originY = 0;
    int displayWidth = 0, displayHeight = 0;
    /// That the file holds (OpenEXR: parts with colours, views of a bundle), of which this is the
    /// first.
    int pictures = 1;
    [[nodiscard]] int bits() const {
        return values.index() == 0 ? 8 : values.index() == 1 ? 16 : 32;
    }
};

/// Decodes an image in memory, all of it: where a part is stored, the rest is 0. PNG, JPEG, OpenEXR
/// NumPy's arrays (npy.hpp) and PNM here, every other format that OpenImageIO reads in a process of
/// its own. Header sizes are checked against the limits and against what the file can hold before
/// pixels are allocated. `name` is for messages and for formats that only their ending shows. Safe
/// to call from several threads, none of which waits for another.
[[nodiscard]] Result<DecodedImage> decodeImage(ByteSpan bytes, std::string_view name,
                                               const Limits& limits);

/// The same, for its depth: of an OpenEXR file with several parts it is another one.
[[nodiscard]] Result<DecodedImage> decodeDepthImage(ByteSpan bytes, std::string_view name,
                                                    const Limits& limits);
/// Which of the channels of these names is depth: Z before other names; -1: none says so.
[[nodiscard]] int depthChannelOf(std::span<const std::string> names);

/// Colours of Rec. 709 in the place of those of other primaries (DecodedImage::rec709FromRgb), for
/// a picture that has R, G and B; others stay. Gives a note of that; empty: nothing was to be done.
[[nodiscard]] std::string toRec709(DecodedImage& image);

/// What pictures lose as 8-bit sRGB.
struct Rgba8Loss {
    int bits = 8;          ///< of integers, the most: above 8 they are rounded
    bool linear = false;   ///< linear light is coded
    bool clipped = false;  ///< some of that is below 0, or more than 1e-6 above 1
    void add(const Rgba8Loss& other);
    void note(Job& job) const;
};

/// What pictures lose together, however often and from however many threads each is read. It is
/// said when this is destroyed.
class SharedRgba8Loss {
  public:
    /// `job` must outlive it.
    explicit SharedRgba8Loss(Job& job) : job_(job) {}
    ~SharedRgba8Loss() { loss_.note(job_); }
    SharedRgba8Loss(const SharedRgba8Loss&) = delete;
    SharedRgba8Loss& operator=(const SharedRgba8Loss&) = delete;
    void add(const Rgba8Loss& loss) {
        const std::lock_guard lock(mutex_);
        loss_.add(loss);
    }

  private:
    Job& job_;
    std::mutex mutex_;
    Rgba8Loss loss_;
};

/// The same as rgba8From(decodeImage()) with toRec709() between them; 8-bit PNG and JPEG are
/// decoded into the result at once. What is lost is added to `loss`, where that is given.
[[nodiscard]] Result<Image<glm::u8vec4>> decodeRgba8(ByteSpan bytes, std::string_view name,
                                                     const Limits& limits,
                                                     Rgba8Loss* loss = nullptr);

/// 8-bit sRGB RGBA with straight alpha of any decoded image (grey is spread, missing alpha is 255,
/// 16 bits are rounded, linear floats are coded as sRGB, premultiplied colours divided). The size
/// is that of the stored pixels. What is lost is added to `loss`, where that is given.
[[nodiscard]] Image<glm::u8vec4> rgba8From(const DecodedImage& image, Rgba8Loss* loss = nullptr);

/// Float RGBA with straight alpha of any decoded image, in the image's own coding: integers / their
/// maximum, floats as they are. Grey is spread, missing alpha is 1.
[[nodiscard]] Image<glm::vec4> rgbaFloatFrom(const DecodedImage& image);

/// A picture as a mask: how far each pixel belongs to what it shows, 0..255, which is its luma
/// times its alpha. Where there is one value beside 0, that is 255: COLMAP and nerfstudio keep what
/// is not 0, and masks of theirs have 1, 255 or the number of a class. `note`: says so where that
/// value is not the largest; else it stays.
[[nodiscard]] Image<std::uint8_t> maskFrom(const Image<glm::u8vec4>& picture, std::string& note);
/// The same of 16-bit codes from 0 to 1, as rgbaFloatFrom() gives them.
[[nodiscard]] Image<std::uint8_t> maskFrom(const Image<glm::vec4>& picture, std::string& note);

/// PNG bytes of 1..4 channels with 8 or 16 bits (values in host order), tagged sRGB when `srgb`.
/// The same input gives the same bytes. `level` is 0 (fast, large) to 9; from 2 on the filter of
/// each row is chosen, which helps depth most.
[[nodiscard]] Result<Bytes> encodePng(int width, int height, int channels, int bits,
                                      const void* values, bool srgb, int level = 6);
/// JPEG bytes of 1 or 3 channels of 8 bits; quality 1..100, no chroma subsampling at 90 and above.
[[nodiscard]] Result<Bytes> encodeJpeg(int width, int height, int channels,
                                       const std::uint8_t* values, int quality);

/// Starts loading OpenImageIO (190 ms) in the process that decodes with it, while the caller does
/// something else, when `input` is an image that it will be needed for, or a folder that holds one.
/// More calls do nothing; errors show at the first image. For programs that decode: others would
/// start a process for nothing.
void preloadCodecs(const std::filesystem::path& input);

}  // namespace stx
