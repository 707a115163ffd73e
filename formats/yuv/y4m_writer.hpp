#pragma once

#include <optional>
#include <string>

#include <glm/glm.hpp>

#include "formats/files/files.hpp"
#include "lib/base/image.hpp"

namespace stx {

struct Y4mOptions {
    /// 4:2:0 is what every program takes; its chroma samples are means of 2x2 pixels (`C420jpeg`).
    enum class Chroma { yuv420, yuv444 };
    /// The format cannot say the matrix. Players take BT.709 from 720 lines on, else BT.601, and so
    /// does `bySize`.
    enum class Matrix { bySize, bt601, bt709 };
    Chroma chroma = Chroma::yuv420;
    Matrix matrix = Matrix::bySize;
    bool fullRange = false;  ///< 0..255 instead of 16..235; tagged by XCOLORRANGE
    int rateNumerator = 30;  ///< frames per second, > 0
    int rateDenominator = 1;
};

/// A stream of uncompressed video frames (YUV4MPEG2), for pipes into encoders: planar 8-bit Y'CbCr,
/// progressive, square pixels. Frames are copied out at once.
class Y4mWriter {
  public:
    /// `file` must outlive the writer; to commit it is the caller's. Error (usage) on a rate or
    /// size that is not positive.
    [[nodiscard]] static Result<Y4mWriter> create(OutputFile& file, int width, int height,
                                                  const Y4mOptions& options = {});
    /// Video has no alpha: what is not opaque must have a background already. Errors: another size
    /// than the first frame's, and those of OutputFile::write().
    [[nodiscard]] Result<void> write(const Image<glm::u8vec4>& opaque);

  private:
    Y4mWriter(OutputFile& file, int width, int height, const Y4mOptions& options)
        : file_(&file), width_(width), height_(height), options_(options) {}
    OutputFile* file_;
    int width_, height_;
    Y4mOptions options_;
};

/// The line that begins a stream, without its newline.
[[nodiscard]] std::string y4mHeader(int width, int height, const Y4mOptions& options);
/// The planes of a frame, Y, Cb and Cr one after the other; odd sizes are rounded up for chroma.
[[nodiscard]] Bytes y4mPlanes(const Image<glm::u8vec4>& opaque, const Y4mOptions& options);

}  // namespace stx
