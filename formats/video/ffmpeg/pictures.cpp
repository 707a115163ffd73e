#include <algorithm>
#include <cstring>

#include "formats/video/ffmpeg/decoder.hpp"
#include "formats/video/wire.hpp"

namespace stx::video {
namespace {

bool hasAlpha(const AVPixFmtDescriptor& format) {
    return (format.flags & AV_PIX_FMT_FLAG_ALPHA) != 0;
}

/// Luma alone, or luma and chroma, and alpha, each in a plane of its own, 8 to 16 bits.
bool isPlanes(const AVPixFmtDescriptor& format) {
    if (format.flags & (AV_PIX_FMT_FLAG_RGB | AV_PIX_FMT_FLAG_PAL | AV_PIX_FMT_FLAG_BITSTREAM |
                        AV_PIX_FMT_FLAG_HWACCEL | AV_PIX_FMT_FLAG_FLOAT | AV_PIX_FMT_FLAG_BAYER))
        return false;
    const int count = format.nb_components - (hasAlpha(format) ? 1 : 0);
    if (count != 1 && count != 3) return false;
    if (format.log2_chroma_w > 1 || format.log2_chroma_h > format.log2_chroma_w) return false;
    for (int i = 0; i < format.nb_components; ++i) {
        const AVComponentDescriptor& c = format.comp[i];
        const int bytes = c.depth > 8 ? 2 : 1;
        if (c.plane != i || c.step != bytes || c.offset != 0 || c.shift != 0 || c.depth < 8 ||
            c.depth > 16 || c.depth != format.comp[0].depth)
            return false;
    }
    return true;
}

void addPlane(std::vector<std::byte>& to, const AVFrame& frame, int plane, int width, int height,
              int bytes, bool bigEndian) {
    for (int y = 0; y < height; ++y) {
        const auto* row = reinterpret_cast<const std::byte*>(
            frame.data[plane] + static_cast<std::ptrdiff_t>(y) * frame.linesize[plane]);
        const auto at = to.size();
        to.insert(to.end(), row, row + static_cast<std::size_t>(width) * bytes);
        if (!bigEndian || bytes == 1) continue;
        for (std::size_t i = at; i + 1 < to.size(); i += 2) std::swap(to[i], to[i + 1]);
    }
}

/// What a stream says, which libav hands on as it is: it may be a value that its enumeration does
/// not have, and that may not be read as one.
template <class Enumeration>
int saidValue(const Enumeration& said) {
    int value = 0;
    static_assert(sizeof(value) == sizeof(said));
    std::memcpy(&value, &said, sizeof(value));
    return value;
}

/// The same of a code of H.273, which libav's numbers are; 2, nothing, of what is none.
template <class Enumeration>
std::uint8_t codeSaid(const Enumeration& said) {
    const int value = saidValue(said);
    return static_cast<std::uint8_t>(value >= 0 && value < 256 ? value : 2);
}

YuvMatrix matrixOf(int space, int height) {
    switch (space) {
        case AVCOL_SPC_BT470BG:
        case AVCOL_SPC_SMPTE170M:
        case AVCOL_SPC_FCC:
            return YuvMatrix::bt601;
        case AVCOL_SPC_SMPTE240M:
            return YuvMatrix::smpte240;
        case AVCOL_SPC_BT2020_NCL:
        case AVCOL_SPC_BT2020_CL:
            return YuvMatrix::bt2020;
        case AVCOL_SPC_UNSPECIFIED:  // as players take it
            return height < 720 ? YuvMatrix::bt601 : YuvMatrix::bt709;
        default:
            return YuvMatrix::bt709;
    }
}

struct FreeScaler {
    void operator()(SwsContext* scaler) const { sws_freeContext(scaler); }
};

/// Other forms of pixels, through libswscale.
std::vector<std::byte> rgbaOf(const AVFrame& frame, YuvMatrix of, bool fullRange) {
    const auto width = frame.width, height = frame.height;
    const std::unique_ptr<SwsContext, FreeScaler> scaler(sws_getContext(
        width, height, static_cast<AVPixelFormat>(frame.format), width, height, AV_PIX_FMT_RGBA,
        SWS_BICUBIC | SWS_ACCURATE_RND | SWS_FULL_CHR_H_INT | SWS_BITEXACT, nullptr, nullptr,
        nullptr));
    if (!scaler)
        refuse(ErrorCode::unsupported, "pixels of the kind {} are not read",
               av_get_pix_fmt_name(static_cast<AVPixelFormat>(frame.format)));
    const int* matrix = sws_getCoefficients(of == YuvMatrix::bt601      ? SWS_CS_ITU601
                                            : of == YuvMatrix::smpte240 ? SWS_CS_SMPTE240M
                                            : of == YuvMatrix::bt2020   ? SWS_CS_BT2020
                                                                        : SWS_CS_ITU709);
    sws_setColorspaceDetails(scaler.get(), matrix, fullRange ? 1 : 0, matrix, 1, 0, 1 << 16,
                             1 << 16);
    std::vector<std::byte> out(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
                               4);
    std::uint8_t* planes[4] = {reinterpret_cast<std::uint8_t*>(out.data())};
    const int strides[4] = {width * 4};
    if (sws_scale(scaler.get(), frame.data, frame.linesize, 0, height, planes, strides) != height)
        refuse(ErrorCode::failed, "libswscale cannot convert the picture");
    return out;
}

}  // namespace

std::vector<std::byte> packed(const AVFrame& frame, const AVCodecContext& codec) {
    const auto pixels = static_cast<AVPixelFormat>(frame.format);
    const AVPixFmtDescriptor* format = av_pix_fmt_desc_get(pixels);
    if (!format || frame.width < 1 || frame.height < 1)
        refuse(ErrorCode::invalidInput, "a picture has no pixels");
    PictureHeader header;
    header.width = frame.width;
    header.height = frame.height;
    header.alpha = hasAlpha(*format);
    const bool grey = format->nb_components - (hasAlpha(*format) ? 1 : 0) == 1;
    const bool jpegPixels = pixels == AV_PIX_FMT_YUVJ420P || pixels == AV_PIX_FMT_YUVJ422P ||
                            pixels == AV_PIX_FMT_YUVJ444P || pixels == AV_PIX_FMT_YUVJ440P;
    const int range = saidValue(frame.color_range), space = saidValue(frame.colorspace);
    header.limitedSaid = range == AVCOL_RANGE_MPEG;
    // Where it is not said, luma alone is of full range, and luma with chroma is not.
    header.fullRange =
        range == AVCOL_RANGE_JPEG || jpegPixels || (grey && range == AVCOL_RANGE_UNSPECIFIED);
    header.matrix = matrixOf(space, frame.height);
    header.primariesSaid = codeSaid(frame.color_primaries);
    header.transferSaid = codeSaid(frame.color_trc);
    header.matrixSaid = codeSaid(frame.colorspace);
    int chroma = saidValue(frame.chroma_location);
    if (chroma == AVCHROMA_LOC_UNSPECIFIED) chroma = saidValue(codec.chroma_sample_location);
    header.chromaLeft = chroma == AVCHROMA_LOC_UNSPECIFIED
                            ? codec.codec_id != AV_CODEC_ID_MJPEG && !jpegPixels
                            : chroma != AVCHROMA_LOC_CENTER && chroma != AVCHROMA_LOC_TOP &&
                                  chroma != AVCHROMA_LOC_BOTTOM;
    Packer out;
    if (!isPlanes(*format)) {
        header.rgba = 1;
        header.bits = std::clamp(format->comp[0].depth, 8, 16);
        const auto rgba = rgbaOf(frame, header.matrix, header.fullRange != 0);
        out.put(header);
        out.add(rgba.data(), rgba.size());
        return std::move(out.bytes);
    }
    header.bits = format->comp[0].depth;
    header.chroma = !grey;
    header.chromaShiftX = format->log2_chroma_w;
    header.chromaShiftY = format->log2_chroma_h;
    out.put(header);
    const int bytes = header.bits > 8 ? 2 : 1;
    const bool bigEndian = (format->flags & AV_PIX_FMT_FLAG_BE) != 0;
    addPlane(out.bytes, frame, 0, frame.width, frame.height, bytes, bigEndian);
    if (!grey) {
        const int width = AV_CEIL_RSHIFT(frame.width, header.chromaShiftX);
        const int height = AV_CEIL_RSHIFT(frame.height, header.chromaShiftY);
        for (const int plane : {1, 2})
            addPlane(out.bytes, frame, plane, width, height, bytes, bigEndian);
    }
    if (hasAlpha(*format))
        addPlane(out.bytes, frame, format->nb_components - 1, frame.width, frame.height, bytes,
                 bigEndian);
    return std::move(out.bytes);
}

}  // namespace stx::video
