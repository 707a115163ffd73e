#pragma once

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/opt.h>
#include <libavutil/pixdesc.h>
#include <libswscale/swscale.h>
}

#include <memory>
#include <string>

#include <fmt/format.h>

#include "lib/base/result.hpp"

/// Only the files of this folder know libav*. What it cannot do is thrown, and caught in serve.cpp.
namespace stx::video {

struct Failed {
    ErrorCode code = ErrorCode::invalidInput;
    std::string message;
};

template <class... Args>
[[noreturn]] void refuse(ErrorCode code, fmt::format_string<Args...> format, Args&&... args) {
    throw Failed{code, fmt::format(format, std::forward<Args>(args)...)};
}

/// libav's words for one of its errors.
inline std::string wordsOf(int error) {
    char text[AV_ERROR_MAX_STRING_SIZE] = {};
    av_strerror(error, text, sizeof(text));
    return text;
}

struct FreeFrame {
    void operator()(AVFrame* frame) const { av_frame_free(&frame); }
};
struct FreePacket {
    void operator()(AVPacket* packet) const { av_packet_free(&packet); }
};
struct FreeCodec {
    void operator()(AVCodecContext* codec) const { avcodec_free_context(&codec); }
};
struct FreeFilm {
    void operator()(AVFormatContext* film) const { avformat_close_input(&film); }
};
struct FreeIo {
    void operator()(AVIOContext* io) const {
        av_freep(&io->buffer);
        avio_context_free(&io);
    }
};
using FramePtr = std::unique_ptr<AVFrame, FreeFrame>;
using PacketPtr = std::unique_ptr<AVPacket, FreePacket>;
using CodecPtr = std::unique_ptr<AVCodecContext, FreeCodec>;
using FilmPtr = std::unique_ptr<AVFormatContext, FreeFilm>;
using IoPtr = std::unique_ptr<AVIOContext, FreeIo>;

}  // namespace stx::video
