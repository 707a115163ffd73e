#include "formats/video/ffmpeg/film_reader.hpp"

#include <sys/stat.h>

#include "formats/video/ffmpeg/logged.hpp"

namespace stx::video {
namespace {

constexpr int kBufferBytes = 1 << 16;
/// More access units are refused as damage: a day at 120 a second is ten million.
constexpr std::size_t kMostUnits = 1u << 24;
constexpr std::uint64_t kLargestAttachment = 1u << 20;
/// Of a part of a track: read from a slow disk in seconds.
constexpr std::int64_t kPartBytes = 64 << 20;
constexpr std::uint64_t kPartUnits = 1u << 16;

std::string tagOf(const AVDictionary* tags, const char* key) {
    const AVDictionaryEntry* entry = av_dict_get(tags, key, nullptr, 0);
    return entry ? entry->value : "";
}

/// A track's matrix where that is of quarter turns and mirrors; players turn by other angles, too,
/// which no camera writes.
Turn turnOf(const AVStream& stream) {
    std::size_t size = 0;
    const std::uint8_t* data = av_stream_get_side_data(&stream, AV_PKT_DATA_DISPLAYMATRIX, &size);
    std::int32_t matrix[9] = {};
    if (!data || size < sizeof(matrix)) return {};
    std::memcpy(matrix, data, sizeof(matrix));
    const auto part = [&](int i) {
        // Fixed point of 16 bits.
        constexpr std::int32_t kHalf = 1 << 15;
        return static_cast<std::int8_t>(matrix[i] > kHalf ? 1 : matrix[i] < -kHalf ? -1 : 0);
    };
    const Turn turn{part(0), part(1), part(3), part(4)};
    const bool straight = turn.a != 0 && turn.d != 0 && turn.b == 0 && turn.c == 0;
    const bool across = turn.a == 0 && turn.d == 0 && turn.b != 0 && turn.c != 0;
    return straight || across ? turn : Turn{};
}

}  // namespace

FilmReader::FilmReader(int file, const std::string& format) {
    source_.file = file;
    struct stat facts = {};
    if (::fstat(file, &facts) != 0) refuse(ErrorCode::io, "the file cannot be read");
    source_.size = facts.st_size;
    const AVInputFormat* reader = av_find_input_format(format.c_str());
    if (!reader) refuse(ErrorCode::unsupported, "libavformat has no reader of {}", format);
    film_.reset(avformat_alloc_context());
    auto* buffer = static_cast<unsigned char*>(av_malloc(kBufferBytes));
    packet_.reset(av_packet_alloc());
    if (!film_ || !buffer || !packet_) throw std::bad_alloc();
    io_.reset(avio_alloc_context(
        buffer, kBufferBytes, 0, &source_,
        [](void* context, std::uint8_t* to, int count) {
            auto& source = *static_cast<Source*>(context);
            const auto n = ::pread(source.file, to, static_cast<std::size_t>(count), source.at);
            if (n <= 0) return n == 0 ? AVERROR_EOF : AVERROR(EIO);
            source.at += n;
            return static_cast<int>(n);
        },
        nullptr,
        [](void* context, std::int64_t offset, int whence) -> std::int64_t {
            auto& source = *static_cast<Source*>(context);
            whence &= ~AVSEEK_FORCE;
            if (whence == AVSEEK_SIZE) return source.size;
            if (whence == SEEK_CUR) offset += source.at;
            if (whence == SEEK_END) offset += source.size;
            if (offset < 0) return AVERROR(EINVAL);
            return source.at = offset;
        }));
    if (!io_) throw std::bad_alloc();
    film_->pb = io_.get();
    film_->flags |= AVFMT_FLAG_CUSTOM_IO;
    // Films name other films, lists and addresses; none is opened.
    film_->io_open = [](AVFormatContext*, AVIOContext**, const char*, int, AVDictionary**) {
        return AVERROR(EPERM);
    };
    AVDictionary* options = nullptr;
    av_dict_set(&options, "protocol_whitelist", "none", 0);
    // Looking at the tracks decodes their first pictures.
    av_dict_set(&options, "codec_whitelist", allowedDecoders().c_str(), 0);
    AVFormatContext* opening = film_.release();  // freed there when it fails
    const int error = avformat_open_input(&opening, nullptr, reader, &options);
    film_.reset(opening);
    av_dict_free(&options);
    if (error < 0)
        refuse(ErrorCode::invalidInput, "it is not a whole {} file: {}", reader->long_name,
               wordsOf(error));
    if (const int found = avformat_find_stream_info(film_.get(), nullptr); found < 0)
        refuse(ErrorCode::invalidInput, "its tracks cannot be read: {}", wordsOf(found));
}

std::vector<std::byte> FilmReader::describe() const {
    Packer out;
    out.put(static_cast<std::uint32_t>(film_->nb_streams));
    for (unsigned i = 0; i < film_->nb_streams; ++i) {
        const AVStream& stream = *film_->streams[i];
        const AVCodecParameters& track = *stream.codecpar;
        const bool picture = (stream.disposition & AV_DISPOSITION_ATTACHED_PIC) != 0;
        out.put(static_cast<std::uint8_t>(track.codec_type == AVMEDIA_TYPE_VIDEO && !picture));
        out.putText(avcodec_get_name(track.codec_id));
        const char* pixels = av_get_pix_fmt_name(static_cast<AVPixelFormat>(track.format));
        out.putText(track.codec_type == AVMEDIA_TYPE_VIDEO && pixels ? pixels : "");
        out.put(static_cast<std::int32_t>(track.width));
        out.put(static_cast<std::int32_t>(track.height));
        out.put(turnOf(stream));
        out.putText(tagOf(stream.metadata, "title"));
        const bool attached =
            track.codec_type == AVMEDIA_TYPE_ATTACHMENT && track.extradata_size > 0 &&
            static_cast<std::uint64_t>(track.extradata_size) <= kLargestAttachment;
        out.putText(attached ? tagOf(stream.metadata, "filename") : "");
        out.putBytes(attached ? std::as_bytes(std::span(track.extradata, static_cast<std::size_t>(
                                                                             track.extradata_size)))
                              : std::span<const std::byte>());
    }
    return std::move(out.bytes);
}

void FilmReader::select(int track) {
    if (track < 0 || track >= static_cast<int>(film_->nb_streams))
        refuse(ErrorCode::invalidInput, "the film has no track {}", track);
    track_ = track;
    for (unsigned i = 0; i < film_->nb_streams; ++i)
        film_->streams[i]->discard =
            static_cast<int>(i) == track ? AVDISCARD_DEFAULT : AVDISCARD_ALL;
    decoder_.emplace(*film_->streams[track]->codecpar);
    units_ = 0;
    damage_.clear();
    rewind();
}

std::vector<std::byte> FilmReader::readOn() {
    if (track_ < 0) refuse(ErrorCode::failed, "no track is chosen");
    const AVStream& stream = *film_->streams[track_];
    Packer units;
    std::uint64_t count = 0;
    std::int64_t bytes = 0;
    const AVPacket* packet = nullptr;
    while (bytes < kPartBytes && count < kPartUnits && (packet = next())) {
        ++count;
        bytes += packet->size;
        if (++units_ > kMostUnits)
            refuse(ErrorCode::invalidInput, "it has more than {} pictures", kMostUnits);
        if (packet->pts == AV_NOPTS_VALUE)
            refuse(ErrorCode::unsupported,
                   "picture {} has no time of its own, as in .avi; put the track into another "
                   "file: ffmpeg -i IN -c copy OUT.mkv",
                   units_ - 1);
        units.put(static_cast<std::int64_t>(packet->pts));
        units.put(
            static_cast<std::int64_t>(packet->dts == AV_NOPTS_VALUE ? packet->pts : packet->dts));
        units.put(static_cast<std::int64_t>(packet->duration));
        units.put(static_cast<std::uint8_t>((packet->flags & AV_PKT_FLAG_KEY) != 0));
        // Edit lists hide pictures that others need.
        units.put(static_cast<std::uint8_t>((packet->flags & AV_PKT_FLAG_DISCARD) != 0));
    }
    const bool last = packet == nullptr;
    // AVI's own reader skips in silence to the next thing that looks like a picture.
    const std::uint64_t indexed =
        std::string_view(film_->iformat->name) == "avi"
            ? static_cast<std::uint64_t>(std::max(0, avformat_index_get_entries_count(&stream)))
            : 0;
    if (last && damage_.empty() && units_ < indexed)
        damage_ = fmt::format("{} of {} in its index are there", units_, indexed);
    if (last) rewind();
    Packer out;
    out.put(static_cast<std::int32_t>(stream.time_base.num));
    out.put(static_cast<std::int32_t>(stream.time_base.den));
    out.put(static_cast<std::uint8_t>(last));
    out.putText(
        damage_.empty()
            ? ""
            : fmt::format("it is damaged, and pictures may be missing in it ({})", damage_));
    out.put(count);
    out.add(units.bytes.data(), units.bytes.size());
    return std::move(out.bytes);
}

const AVPacket* FilmReader::next() {
    if (held_) {
        held_ = false;
        return packet_.get();
    }
    for (;;) {
        av_packet_unref(packet_.get());
        forgetErrors();
        const int got = av_read_frame(film_.get(), packet_.get());
        // Readers skip what they do not understand, up to where they understand again.
        if (damage_.empty()) damage_ = loggedErrors().demuxer;
        if (got == AVERROR_EOF) return nullptr;
        if (got < 0) refuse(ErrorCode::invalidInput, "the film is cut off: {}", wordsOf(got));
        if (packet_->stream_index != track_) continue;
        // Containers without composition times hold one picture after the other.
        if (packet_->pts == AV_NOPTS_VALUE && film_->streams[track_]->codecpar->video_delay == 0)
            packet_->pts = packet_->dts;
        return packet_.get();
    }
}

void FilmReader::rewind() {
    held_ = ended_ = false;
    const int error = avformat_seek_file(film_.get(), -1, INT64_MIN, INT64_MIN, INT64_MAX, 0);
    if (error < 0 && av_seek_frame(film_.get(), -1, 0, AVSEEK_FLAG_BACKWARD) < 0)
        refuse(ErrorCode::invalidInput, "its beginning cannot be found again: {}", wordsOf(error));
}

void FilmReader::seek(std::int64_t dts, std::int64_t pts) {
    decoder().flush();
    held_ = ended_ = false;
    const bool matroska = std::string_view(film_->iformat->name).starts_with("matroska");
    if (av_seek_frame(film_.get(), track_, matroska ? pts : dts, AVSEEK_FLAG_BACKWARD) >= 0) {
        // At most a few: the place is that of a key picture at or before it.
        while (const AVPacket* packet = next()) {
            if (packet->pts > pts && packet->dts > dts) break;
            if (packet->pts != pts) continue;
            held_ = true;
            return;
        }
    }
    rewind();
    while (const AVPacket* packet = next()) {
        if (packet->pts != pts) continue;
        held_ = true;
        return;
    }
    refuse(ErrorCode::invalidInput, "its pictures cannot be found again");
}

bool FilmReader::step(std::int64_t wanted) {
    if (ended_) return false;
    const AVPacket* packet = next();
    decoder().push(packet, wanted);
    ended_ = packet == nullptr;
    return !ended_;
}

Decoder& FilmReader::decoder() {
    if (!decoder_) refuse(ErrorCode::failed, "no track is chosen");
    return *decoder_;
}

}  // namespace stx::video
