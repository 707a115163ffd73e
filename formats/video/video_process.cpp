#include "formats/video/video_process.hpp"

namespace stx {

Result<std::unique_ptr<VideoProcess>> VideoProcess::start(const Limits& limits, int file) {
    DecoderBounds bounds;
    // Beside the limit: what the libraries need before they decode.
    bounds.memoryBytes = limits.maxMemoryBytes + (256u << 20);
    std::unique_ptr<VideoProcess> process(new VideoProcess());
    STX_TRY(process->process_, DecoderProcess::start(decoders::kVideo, bounds, file));
    process->most_ = limits.maxMemoryBytes;
    return process;
}

Result<Bytes> VideoProcess::ask(video::Tag request, ByteSpan bytes, video::Tag expected) {
    video::Tag tag{};
    Bytes answer;
    process_->send(request, bytes);
    if (process_->receiveMessage(tag, answer, most_)) {
        if (tag == expected) return answer;
        if (tag == video::Tag::failure) return tl::unexpected(errorIn(answer));
    }
    return process_->lost();
}

}  // namespace stx
