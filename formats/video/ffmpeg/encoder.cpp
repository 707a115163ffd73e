#include "formats/video/ffmpeg/encoder.hpp"

namespace stx::video {
namespace {

/// Access units between pictures that can be decoded by themselves: what a seek costs at most.
constexpr int kGroup = 25;

}  // namespace

Encoder::Encoder(const EncoderRequest& request) : request_(request) {
    const AVCodec* codec = avcodec_find_encoder_by_name("libx264");
    if (!codec)
        refuse(ErrorCode::unsupported,
               "this libavcodec has no libx264; Debian's has (libavcodec59, libx264-164)");
    codec_.reset(avcodec_alloc_context3(codec));
    if (!codec_) throw std::bad_alloc();
    codec_->width = request.width;
    codec_->height = request.height;
    codec_->time_base = {1, static_cast<int>(request.timescale)};
    codec_->framerate = av_d2q(request.rate, 1001000);
    const bool grey = request.chromaFormat == 0, fine = request.bits > 8;
    if (grey)
        codec_->pix_fmt = fine ? AV_PIX_FMT_GRAY10 : AV_PIX_FMT_GRAY8;
    else if (request.chromaFormat == 3)
        codec_->pix_fmt = fine ? AV_PIX_FMT_YUV444P10 : AV_PIX_FMT_YUV444P;
    else
        codec_->pix_fmt = fine ? AV_PIX_FMT_YUV420P10 : AV_PIX_FMT_YUV420P;
    codec_->color_range = AVCOL_RANGE_JPEG;
    if (!grey) {
        codec_->colorspace = AVCOL_SPC_BT709;
        codec_->color_primaries = AVCOL_PRI_BT709;
        codec_->color_trc = AVCOL_TRC_IEC61966_2_1;
        codec_->chroma_sample_location = AVCHROMA_LOC_LEFT;
    }
    codec_->gop_size = kGroup;
    codec_->max_b_frames = 0;
    codec_->thread_count = 1;
    codec_->flags |= AV_CODEC_FLAG_GLOBAL_HEADER | AV_CODEC_FLAG_CLOSED_GOP;
    if (request.crf < 0)
        av_opt_set_int(codec_->priv_data, "qp", 0, 0);
    else
        av_opt_set_double(codec_->priv_data, "crf", request.crf, 0);
    // Nothing waits for later pictures.
    av_opt_set(codec_->priv_data, "x264-params", "rc-lookahead=0:sync-lookahead=0:mbtree=0", 0);
    if (const int error = avcodec_open2(codec_.get(), codec, nullptr); error < 0)
        refuse(ErrorCode::unsupported, "H.264 cannot be written for {}x{} of {} bits{}: {}",
               request.width, request.height, request.bits, grey ? ", grey" : "", wordsOf(error));
}

std::span<const std::byte> Encoder::configuration() const {
    return std::as_bytes(
        std::span(codec_->extradata, static_cast<std::size_t>(codec_->extradata_size)));
}

void Encoder::encode(std::int64_t time, std::span<const std::byte> planes, Packer& units) {
    FramePtr frame(av_frame_alloc());
    if (!frame) throw std::bad_alloc();
    frame->format = codec_->pix_fmt;
    frame->width = codec_->width;
    frame->height = codec_->height;
    frame->color_range = codec_->color_range;
    frame->colorspace = codec_->colorspace;
    frame->pts = time;
    if (av_frame_get_buffer(frame.get(), 0) < 0) throw std::bad_alloc();
    const int bytes = request_.bits > 8 ? 2 : 1;
    for (int plane = 0; plane < (request_.chromaFormat == 0 ? 1 : 3); ++plane) {
        const int shift = plane > 0 && request_.chromaFormat == 1 ? 1 : 0;
        const int width = AV_CEIL_RSHIFT(frame->width, shift);
        const int height = AV_CEIL_RSHIFT(frame->height, shift);
        const std::size_t row = static_cast<std::size_t>(width) * bytes;
        if (planes.size() < row * static_cast<std::size_t>(height))
            refuse(ErrorCode::failed, "a picture to be coded is too small");
        for (int y = 0; y < height; ++y, planes = planes.subspan(row))
            std::memcpy(
                frame->data[plane] + static_cast<std::ptrdiff_t>(y) * frame->linesize[plane],
                planes.data(), row);
    }
    if (const int error = avcodec_send_frame(codec_.get(), frame.get()); error < 0)
        refuse(ErrorCode::failed, "a picture cannot be coded: {}", wordsOf(error));
    drain(units);
}

void Encoder::finish(Packer& units) {
    avcodec_send_frame(codec_.get(), nullptr);
    drain(units);
}

void Encoder::drain(Packer& units) {
    const PacketPtr packet(av_packet_alloc());
    if (!packet) throw std::bad_alloc();
    for (;;) {
        const int got = avcodec_receive_packet(codec_.get(), packet.get());
        if (got == AVERROR(EAGAIN) || got == AVERROR_EOF) return;
        if (got < 0) refuse(ErrorCode::failed, "a picture cannot be coded: {}", wordsOf(got));
        if (packet->pts != packet->dts)
            refuse(ErrorCode::failed, "the encoder changed the order of the pictures");
        units.put(static_cast<std::int64_t>(packet->pts));
        units.put(static_cast<std::uint8_t>((packet->flags & AV_PKT_FLAG_KEY) != 0));
        units.putBytes(
            std::as_bytes(std::span(packet->data, static_cast<std::size_t>(packet->size))));
        av_packet_unref(packet.get());
    }
}

}  // namespace stx::video
