#include "formats/video/ffmpeg/decoder.hpp"

#include <algorithm>

#include "formats/video/ffmpeg/logged.hpp"

namespace stx::video {
namespace {

/// Pictures before the one that is wanted that are kept: threads ask for neighbours.
constexpr std::size_t kKept = 8;

/// What is decoded: codecs that films and depth are really in. Each one more is more to attack.
constexpr AVCodecID kAllowed[] = {
    AV_CODEC_ID_H264,       AV_CODEC_ID_HEVC,    AV_CODEC_ID_MPEG4, AV_CODEC_ID_MPEG2VIDEO,
    AV_CODEC_ID_MPEG1VIDEO, AV_CODEC_ID_MJPEG,   AV_CODEC_ID_FFV1,  AV_CODEC_ID_RAWVIDEO,
    AV_CODEC_ID_PNG,        AV_CODEC_ID_VP8,     AV_CODEC_ID_VP9,   AV_CODEC_ID_AV1,
    AV_CODEC_ID_HUFFYUV,    AV_CODEC_ID_FFVHUFF, AV_CODEC_ID_PRORES};

bool isAllowed(AVCodecID id) {
    return std::find(std::begin(kAllowed), std::end(kAllowed), id) != std::end(kAllowed);
}

AVCodecID codecOf(int objectTypeIndication) {
    switch (objectTypeIndication) {
        case 0x20:
            return AV_CODEC_ID_MPEG4;
        case 0x21:
            return AV_CODEC_ID_H264;
        case 0x23:
            return AV_CODEC_ID_HEVC;
        case 0x6A:
            return AV_CODEC_ID_MPEG1VIDEO;
        default:
            if (objectTypeIndication >= 0x60 && objectTypeIndication <= 0x65)
                return AV_CODEC_ID_MPEG2VIDEO;
            return AV_CODEC_ID_NONE;
    }
}

}  // namespace

std::string allowedDecoders() {
    std::string names;
    for (const AVCodecID id : kAllowed)
        if (const AVCodec* codec = avcodec_find_decoder(id))
            names += (names.empty() ? "" : ",") + std::string(codec->name);
    return names;
}

Decoder::Decoder(const AVCodecParameters& track) {
    open(track.codec_id, &track, {});
}

Decoder::Decoder(int objectTypeIndication, std::span<const std::byte> configuration) {
    const AVCodecID id = codecOf(objectTypeIndication);
    if (id == AV_CODEC_ID_NONE)
        refuse(ErrorCode::unsupported,
               "streams of objectTypeIndication 0x{:02X} are not decoded; H.264 (0x21), HEVC "
               "(0x23), MPEG-4 Visual (0x20), MPEG-2 and MPEG-1 video are",
               objectTypeIndication);
    open(id, nullptr, configuration);
}

void Decoder::open(AVCodecID id, const AVCodecParameters* track,
                   std::span<const std::byte> configuration) {
    if (!isAllowed(id))
        refuse(ErrorCode::unsupported,
               "video in {} is not decoded; make it H.264, or FFV1, which loses nothing: ffmpeg -i "
               "IN -c:v ffv1 OUT.mkv",
               avcodec_get_name(id));
    const AVCodec* codec = avcodec_find_decoder(id);
    if (!codec)
        refuse(ErrorCode::unsupported, "libavcodec has no decoder of {}", avcodec_get_name(id));
    codec_.reset(avcodec_alloc_context3(codec));
    if (!codec_) throw std::bad_alloc();
    if (track && avcodec_parameters_to_context(codec_.get(), track) < 0) throw std::bad_alloc();
    if (!configuration.empty()) {
        codec_->extradata = static_cast<std::uint8_t*>(
            av_mallocz(configuration.size() + AV_INPUT_BUFFER_PADDING_SIZE));
        if (!codec_->extradata) throw std::bad_alloc();
        std::memcpy(codec_->extradata, configuration.data(), configuration.size());
        codec_->extradata_size = static_cast<int>(configuration.size());
    }
    codec_->thread_count = 1;
    // Damage is an error, not painted over.
    codec_->err_recognition = AV_EF_CRCCHECK | AV_EF_BITSTREAM | AV_EF_BUFFER | AV_EF_EXPLODE;
    codec_->error_concealment = 0;
    if (const int error = avcodec_open2(codec_.get(), codec, nullptr); error < 0)
        refuse(ErrorCode::invalidInput, "its decoder of {} cannot begin: {}", avcodec_get_name(id),
               wordsOf(error));
}

void Decoder::push(const AVPacket* packet, std::int64_t wanted) {
    const auto damaged = [&](const std::string& why) {
        refuse(ErrorCode::invalidInput, "the video is damaged here ({})", why);
    };
    forgetErrors();
    const int sent = avcodec_send_packet(codec_.get(), packet);
    if (sent < 0 && sent != AVERROR_EOF) damaged(wordsOf(sent));
    for (;;) {
        FramePtr frame(av_frame_alloc());
        if (!frame) throw std::bad_alloc();
        const int got = avcodec_receive_frame(codec_.get(), frame.get());
        if (got == AVERROR(EAGAIN) || got == AVERROR_EOF) break;
        if (got < 0) damaged(wordsOf(got));
        if (frame->decode_error_flags != 0) damaged("a picture has missing parts");
        // FFV1's decoder takes a slice without its checksum for that of the picture before,
        // whatever is asked of it, and only its log says so.
        if (codec_->codec_id == AV_CODEC_ID_FFV1 && !loggedErrors().other.empty())
            damaged("a part of a picture does not have its checksum");
        if (frame->pts == AV_NOPTS_VALUE) frame->pts = frame->best_effort_timestamp;
        ready_.push_back(std::move(frame));
    }
    const auto before = static_cast<std::size_t>(
        std::ranges::count_if(ready_, [&](const auto& frame) { return frame->pts < wanted; }));
    for (std::size_t i = kKept; i < before; ++i) ready_.pop_front();
}

void Decoder::flush() {
    avcodec_flush_buffers(codec_.get());
    ready_.clear();
}

std::vector<std::int64_t> Decoder::times() const {
    std::vector<std::int64_t> out;
    for (const auto& frame : ready_) out.push_back(frame->pts);
    return out;
}

const AVFrame* Decoder::find(std::int64_t time) const {
    const auto found =
        std::ranges::find_if(ready_, [&](const auto& frame) { return frame->pts == time; });
    return found == ready_.end() ? nullptr : found->get();
}

}  // namespace stx::video
