// Uncompressed video: any bytes give frames of the size that was said, or one error.

#include <cstdlib>

#include "formats/yuv/y4m_reader.hpp"

using namespace stx;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    Job job;
    job.limits.maxMemoryBytes = 8u << 20;
    const ByteSpan bytes(reinterpret_cast<const std::byte*>(data), size);
    const auto reader =
        Y4mReader::open(ByteSource::fromBytes(Bytes(bytes.begin(), bytes.end())), job);
    if (!reader) {
        if (reader.error().message.empty()) std::abort();
        return 0;
    }
    if (reader->count() < 1 || !Y4mReader::recognises(bytes)) std::abort();
    for (const int k : {0, reader->count() - 1}) {
        const auto frame = reader->frame(k, job.limits);
        if (!frame) continue;
        if (frame->width() != reader->width() || frame->height() != reader->height()) std::abort();
    }
    return 0;
}
