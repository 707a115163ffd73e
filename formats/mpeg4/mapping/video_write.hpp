#pragma once

#include <functional>
#include <memory>

#include "formats/mpeg4/scene/document.hpp"
#include "formats/mpeg4/scene/placement.hpp"
#include "formats/video/video_process.hpp"
#include "lib/base/job.hpp"
#include "lib/model/reference_view.hpp"

namespace stx::mpeg4 {

/// Bits of the depth of a view as H.264 holds it: 8, or 10 of finer ones.
[[nodiscard]] inline int videoDepthBits(int depthBits) {
    return depthBits == 8 ? 8 : 10;
}

/// How much chroma colour of this size has, H.264's chroma_format_idc (ISO/IEC 14496-10, 6.2): 1 is
/// 4:2:0, which has even sides only (the cropping rectangle counts in its chroma); else 3, 4:4:4.
[[nodiscard]] inline int chromaFormatOf(int width, int height) {
    return width % 2 == 0 && height % 2 == 0 ? 1 : 3;
}

/// Planes of a picture as the encoder takes them, of full range by BT.709, with the chroma of
/// chromaFormatOf(); that of 4:2:0 on the left column of its pixels.
[[nodiscard]] Bytes yuvPlanes(const Rgba8Image& picture);
/// The plane of depth codes, padded with 0. `worst` becomes the largest difference between a
/// distance and its code's, scene units. Error: a depth that is NaN or below 0.
[[nodiscard]] Result<Bytes> depthPlane(const Image<float>& depth, const DepthCode& code,
                                       const Padding& padding, double& worst);

/// An AVCDecoderConfigurationRecord (ISO/IEC 14496-15, 5.3.3.1) of the parameter sets in a byte
/// stream (Annex B). `chromaFormat` is its chroma_format_idc. Error (failed): none in it.
[[nodiscard]] Result<Bytes> avcConfiguration(ByteSpan byteStream, int chromaFormat, int bits);
/// The access unit with lengths of four bytes in place of start codes.
[[nodiscard]] Bytes withLengths(ByteSpan byteStream);

/// Streams of H.264 on their way into a document, all in one process. Monochrome is lossless.
class VideoStreams {
  public:
    /// Where the bytes of an access unit go.
    using Keep = std::function<Result<ByteRange>(const Bytes&)>;

    /// `rate`: pictures a second, on average.
    VideoStreams(int crf, double rate, const Limits& limits, Keep keep)
        : crf_(crf), rate_(rate), limits_(limits), keep_(std::move(keep)) {}

    /// Makes an H.264 stream, without samples, of one that held images of this size. `bits`: 8 or
    /// 10. Error (unsupported): no module of video.
    [[nodiscard]] Result<int> begin(ElementaryStream& stream, int width, int height, bool grey,
                                    int bits);
    /// Adds a picture to stream `number`; `time` in its ticks, ascending.
    [[nodiscard]] Result<void> add(int number, std::uint64_t time, const Bytes& planes);
    /// Adds what waits.
    [[nodiscard]] Result<void> finish();

  private:
    [[nodiscard]] Result<void> take(int number, const Bytes& answer);

    int crf_;
    double rate_;
    Limits limits_;
    Keep keep_;
    std::unique_ptr<VideoProcess> process_;
    std::vector<ElementaryStream*> streams_;
};

}  // namespace stx::mpeg4
