#pragma once

#include <cstdint>
#include <vector>

#include "formats/files/byte_source.hpp"
#include "formats/yuv/yuv.hpp"
#include "lib/base/job.hpp"
#include "lib/model/texture.hpp"

namespace stx {

/// A file of uncompressed video frames (YUV4MPEG2), any frame at random. 4:2:0, 4:2:2, 4:4:4 and
/// luma alone, of 8 to 16 bits; the colours of BT.709 from 720 lines on, else of BT.601, as players
/// take them; XCOLORRANGE=FULL is 0..255, and so is luma alone that does not say its range. Opening
/// finds where the frames are, and reads none.
class Y4mReader {
  public:
    /// Errors (invalidInput), with the byte: no such file, sizes out of range, a kind of pixels
    /// that is not read, a frame that is cut off or does not begin where it must; memory over the
    /// limit. A note when frames are interlaced.
    [[nodiscard]] static Result<Y4mReader> open(ByteSource source, Job& job);
    /// Whether the first bytes of a file are those of such a file.
    [[nodiscard]] static bool recognises(ByteSpan head);

    [[nodiscard]] int width() const { return format_.width; }
    [[nodiscard]] int height() const { return format_.height; }
    [[nodiscard]] int bits() const { return format_.bits; }  ///< of a sample, 8 to 16
    [[nodiscard]] int count() const { return static_cast<int>(frames_.size()); }
    /// One frame as 8-bit RGB, opaque. From several threads. Errors: io; values beyond the bits;
    /// memory over the limit.
    [[nodiscard]] Result<Rgba8Image> frame(int k, const Limits& limits) const;

  private:
    Y4mReader() = default;
    ByteSource source_;
    YuvFormat format_;
    YuvColour colour_;
    std::vector<std::uint64_t> frames_;  ///< where the samples of each begin
};

}  // namespace stx
