// Compressed video as the module's process reads it (formats/video/ffmpeg): any bytes give tracks,
// times and pictures that the other side takes, or one error. What begins with "ES" is a stream as
// MPEG-4 holds it: objectTypeIndication, the size of the decoder's configuration, then access units
// behind their sizes (bytes). All else is a film.
//
// The corpus was made by ffmpeg 5.1 (-bitexact): 3 to 6 pictures of testsrc, 16x12.

#include <sys/mman.h>
#include <unistd.h>

#include <cstdlib>

#include "formats/video/ffmpeg/film_reader.hpp"
#include "formats/video/ffmpeg/logged.hpp"
#include "formats/video/film.hpp"

using namespace stx;

namespace {

constexpr int kMostSteps = 40;

/// A file that is only in memory.
class MemoryFile {
  public:
    explicit MemoryFile(ByteSpan bytes) : file_(::memfd_create("fuzz", MFD_CLOEXEC)) {
        if (file_ < 0 ||
            ::write(file_, bytes.data(), bytes.size()) != static_cast<ssize_t>(bytes.size()))
            std::abort();
    }
    ~MemoryFile() { ::close(file_); }
    MemoryFile(const MemoryFile&) = delete;
    MemoryFile& operator=(const MemoryFile&) = delete;
    [[nodiscard]] int get() const { return file_; }

  private:
    int file_;
};

/// All pictures that wait are such as the owner of the process takes.
void takeAll(const video::Decoder& decoder, const Limits& limits) {
    for (const std::int64_t time : decoder.times()) {
        const AVFrame* frame = decoder.find(time);
        if (!frame) std::abort();
        Bytes answer = video::packed(*frame, decoder.codec());
        const auto picture = VideoPicture::from(std::move(answer), limits);
        if (!picture) {
            if (picture.error().code != ErrorCode::invalidInput) std::abort();
            continue;
        }
        const auto colour = picture->colour(limits);
        if (colour && colour->width() < 1) std::abort();
        if (picture->lumaCodes().empty()) std::abort();
    }
}

void readStream(ByteSpan bytes, const Limits& limits) {
    const auto byteOf = [&](std::size_t at) {
        return at < bytes.size() ? std::to_integer<std::size_t>(bytes[at]) : 0;
    };
    const auto part = [&](std::size_t at, std::size_t size) {
        at = std::min(at, bytes.size());
        return bytes.subspan(at, std::min(size, bytes.size() - at));
    };
    const std::size_t configuration = byteOf(1);
    video::Decoder decoder(static_cast<int>(byteOf(0)), part(2, configuration));
    std::size_t at = 2 + configuration;
    for (int step = 0; step < kMostSteps && at < bytes.size(); ++step) {
        const ByteSpan unit = part(at + 2, byteOf(at) << 8 | byteOf(at + 1));
        at += 2 + unit.size();
        const video::PacketPtr packet(av_packet_alloc());
        if (!packet || av_new_packet(packet.get(), static_cast<int>(unit.size())) < 0) return;
        if (!unit.empty()) std::memcpy(packet->data, unit.data(), unit.size());
        packet->pts = step;
        decoder.push(packet.get(), step);
        takeAll(decoder, limits);
    }
    decoder.push(nullptr, kMostSteps);
    takeAll(decoder, limits);
}

void readFilm(ByteSpan bytes, const Limits& limits) {
    const std::string_view format =
        filmFormatOf(bytes.first(std::min<std::size_t>(16, bytes.size())));
    if (format.empty()) return;
    const MemoryFile file(bytes);
    video::FilmReader film(file.get(), std::string(format));
    const auto described = film.describe();
    video::Unpacker in(described);
    const auto count = in.get<std::uint32_t>();
    for (std::uint32_t track = 0; track < std::min(count, 3u); ++track) {
        const bool isVideo = in.get<std::uint8_t>() != 0;
        for (int text = 0; text < 2; ++text) (void)in.getText();
        const auto width = in.get<std::int32_t>(), height = in.get<std::int32_t>();
        (void)in.get<video::Turn>();
        for (int text = 0; text < 2; ++text) (void)in.getText();
        (void)in.getBytes();
        if (!in.ok()) std::abort();
        // Film::select() refuses them before the process hears of them.
        if (!isVideo || width < 1 || height < 1 || width > limits.maxImageSide ||
            height > limits.maxImageSide)
            continue;
        try {
            film.select(static_cast<int>(track));
            const auto part = film.readOn();
            video::Unpacker index(part);
            (void)index.get<std::int32_t>();
            (void)index.get<std::int32_t>();
            (void)index.get<std::uint8_t>();
            (void)index.getText();  // why pictures may be missing
            const auto units = index.get<std::uint64_t>();
            std::int64_t pts = 0, dts = 0;
            for (std::uint64_t i = 0; i < units; ++i) {
                pts = index.get<std::int64_t>();
                dts = index.get<std::int64_t>();
                (void)index.get<std::int64_t>();
                (void)index.get<std::uint16_t>();  // whether it can begin, whether it is hidden
            }
            if (!index.ok() || !index.rest().empty()) std::abort();
            for (int step = 0; step < kMostSteps && film.step(step); ++step)
                takeAll(film.decoder(), limits);
            takeAll(film.decoder(), limits);
            if (units > 0) {
                film.seek(dts, pts);
                film.step(pts);
                takeAll(film.decoder(), limits);
            }
        } catch (const video::Failed& failed) {
            if (failed.message.empty()) std::abort();
        }
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    // As the process's own memory is bounded.
    av_max_alloc(32u << 20);
    video::listenToErrors();
    Limits limits;
    limits.maxMemoryBytes = 32u << 20;
    limits.maxImageSide = 256;
    const ByteSpan bytes(reinterpret_cast<const std::byte*>(data), size);
    try {
        if (size >= 2 && data[0] == 'E' && data[1] == 'S')
            readStream(bytes.subspan(2), limits);
        else
            readFilm(bytes, limits);
    } catch (const video::Failed& failed) {
        if (failed.message.empty()) std::abort();
    } catch (const std::bad_alloc&) {
        // Told by serve.cpp.
    }
    return 0;
}
