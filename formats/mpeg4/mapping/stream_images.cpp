#include "formats/mpeg4/mapping/stream_images.hpp"

#include <algorithm>
#include <numeric>

#include "formats/mpeg4/mapping/texture_images.hpp"
#include "formats/mpeg4/text/text_values.hpp"
#include "lib/model/sequence.hpp"

namespace stx::mpeg4 {
namespace {

const std::vector<Url>* urlsOf(const Node& texture) {
    const int index = texture.info->find("url");
    return index < 0 ? nullptr : std::get_if<std::vector<Url>>(&texture.value(index));
}

/// In words, of streams that no image codec reads.
const char* videoName(int objectTypeIndication) {
    switch (objectTypeIndication) {
        case 0x20:
            return " (MPEG-4 Visual)";
        case oti::kAvc:
            return " (H.264)";
        case oti::kHevc:
            return " (HEVC)";
        default:
            return "";
    }
}

bool isVideo(const ElementaryStream& stream) {
    return stream.objectTypeIndication != 0 && stream.objectTypeIndication != oti::kJpeg &&
           stream.objectTypeIndication != oti::kPng;
}

/// Bits of a value of video's luma, where its decoder's configuration tells; else 8.
/// AVCDecoderConfigurationRecord and HEVCDecoderConfigurationRecord: ISO/IEC 14496-15, 5.3.3.1.2
/// and 8.3.3.1.2.
int lumaBits(const ElementaryStream& stream) {
    const Bytes& record = stream.decoderSpecificInfo;
    const auto at = [&](std::size_t place) {
        return place < record.size() ? std::to_integer<unsigned>(record[place]) : 0u;
    };
    if (stream.objectTypeIndication == oti::kHevc) return 8 + static_cast<int>(at(17) & 7);
    if (stream.objectTypeIndication != oti::kAvc) return 8;
    // Behind the sequence's and the picture's parameters, in profiles that have other depths.
    std::size_t place = 5;
    for (const unsigned mask : {0x1Fu, 0xFFu}) {
        const unsigned sets = at(place++) & mask;
        for (unsigned i = 0; i < sets; ++i) place += 2 + at(place) * 256 + at(place + 1);
    }
    const bool tells = at(1) == 100 || at(1) == 110 || at(1) == 122 || at(1) == 244;
    return tells ? 8 + static_cast<int>(at(place + 1) & 7) : 8;
}

}  // namespace

bool holdsVideo(const Document& document) {
    for (const ObjectDescriptor* od : document.objectDescriptors())
        for (const ElementaryStream& stream : od->streams)
            if (stream.streamType == StreamType::visual && isVideo(stream)) return true;
    return false;
}

Result<StreamImages> StreamImages::make(const Document& document,
                                        const std::filesystem::path& folder, const Limits& limits) {
    StreamImages images;
    images.folder_ = folder;
    images.limits_ = limits;
    images.document_ = &document;
    double start = 0;
    if (!document.frames.empty())
        start = static_cast<double>(document.frames[0].time) / document.sceneStream.timescale;
    images.odOrder_.resize(document.odFrames.size());
    std::iota(images.odOrder_.begin(), images.odOrder_.end(), std::size_t{0});
    std::ranges::stable_sort(images.odOrder_, {},
                             [&](std::size_t i) { return document.odFrames[i].time; });
    images.setTime(start);
    // Found before threads ask for them.
    for (const OdFrame& frame : document.odFrames)
        for (const OdCommand& command : frame.commands)
            if (const auto* update = std::get_if<UpdateObjectDescriptors>(&command))
                for (const ObjectDescriptor& od : update->descriptors)
                    for (const ElementaryStream& stream : od.streams)
                        if (stream.samples.size() > 1) (void)images.presentation(stream);
    return images;
}

void StreamImages::setTime(double now, double slack) {
    now_ = now;
    slack_ = slack;
    const std::vector<OdFrame>& frames = document_->odFrames;
    const auto ticks = ticksBegun(now, document_->odStream.timescale, slack);
    if (!begun_ || ticks < odTicks_) {
        byId_.clear();
        removed_.clear();
        for (const ObjectDescriptor* od : document_->objectDescriptors()) byId_[od->id] = od;
        nextOd_ = 0;
        begun_ = true;
    }
    odTicks_ = ticks;
    for (; nextOd_ < odOrder_.size() && frames[odOrder_[nextOd_]].time <= ticks; ++nextOd_)
        for (const OdCommand& command : frames[odOrder_[nextOd_]].commands) {
            if (const auto* update = std::get_if<UpdateObjectDescriptors>(&command))
                for (const ObjectDescriptor& od : update->descriptors) byId_[od.id] = &od;
            if (const auto* removal = std::get_if<RemoveObjectDescriptors>(&command))
                for (const int id : removal->ids)
                    if (byId_.erase(id) > 0) removed_.insert(id);
        }
}

const Presentation& StreamImages::presentation(const ElementaryStream& stream) const {
    const auto found = presentations_->find(&stream);
    if (found != presentations_->end()) return found->second;
    return presentations_->emplace(&stream, presentationOf(stream)).first->second;
}

std::size_t StreamImages::sampleAt(const Node& texture, const ElementaryStream& stream) const {
    const auto found = presentations_->find(&stream);
    if (stream.samples.size() < 2 || found == presentations_->end()) return 0;
    const Presentation& shown = found->second;
    const double slack = std::max(slack_, halfTick(shown.tick, now_));
    return shown.sampleAt(mediaTimeOf(texture, shown.duration, now_, slack),
                          runsBackwards(texture, now_ + slack) ? -slack : slack);
}

const ElementaryStream* StreamImages::stream(const Node& texture) const {
    const auto source = sourceOf(texture);
    return source ? source->stream : nullptr;
}

Result<StreamImages::Source> StreamImages::sourceOf(const Node& texture) const {
    const auto* urls = urlsOf(texture);
    if (!urls)
        return fail(ErrorCode::unsupported,
                    "a {} stands where an image is needed; ImageTexture, MovieTexture "
                    "and PixelTexture are read",
                    texture.info->name);
    if (urls->empty())
        return fail(ErrorCode::invalidInput, "the {} has no url", texture.info->name);
    Error last;
    for (const Url& url : *urls) {
        if (url.objectDescriptorId != 0) {
            auto stream = streamOf(url);
            if (stream) return Source{&url, *stream};
            last = std::move(stream.error());
        } else {
            auto file = fileOf(url);
            if (file) return Source{&url, nullptr};
            last = std::move(file.error());
        }
    }
    return tl::unexpected(last);
}

Result<const ElementaryStream*> StreamImages::streamOf(const Url& url) const {
    const auto found = byId_.find(url.objectDescriptorId);
    if (found == byId_.end() && removed_.contains(url.objectDescriptorId))
        return fail(ErrorCode::invalidInput,
                    "object descriptor {} is named, which a command has removed before; name "
                    "another, or remove it when nothing shows it",
                    url.objectDescriptorId);
    if (found == byId_.end())
        return fail(ErrorCode::invalidInput,
                    "object descriptor {} is named, which the presentation does not have",
                    url.objectDescriptorId);
    const ObjectDescriptor& od = *found->second;
    if (od.streams.empty() || od.streams[0].samples.empty())
        return fail(ErrorCode::invalidInput,
                    "object descriptor {} has no stream with an image in this file", od.id);
    const ElementaryStream& stream = od.streams[0];
    // Of video only a decoder knows what a sample without bytes shows.
    if (stream.samples[0].data.size == 0 && !isVideo(stream))
        return fail(ErrorCode::invalidInput,
                    "the image '{}' of object descriptor {} was not loaded",
                    excerpt(stream.fileName), od.id);
    return &stream;
}

Result<std::filesystem::path> StreamImages::fileOf(const Url& url) const {
    if (folder_.empty())
        return fail(ErrorCode::invalidInput, "the url '{}' is not an object descriptor",
                    excerpt(url.text));
    const std::lock_guard lock(files_->mutex);
    const auto [entry, fresh] = files_->byText.try_emplace(url.text);
    if (fresh) entry->second = resolveInside(folder_, url.text, limits_);
    return entry->second;
}

Result<Bytes> StreamImages::bytesOf(const Node& texture, const Source& source,
                                    const Limits& limits) const {
    if (const ElementaryStream* stream = source.stream)
        return stream->samples[sampleAt(texture, *stream)].data.load(limits);
    STX_TRY(const auto file, fileOf(*source.url));
    return readFile(file, limits);
}

Result<Bytes> StreamImages::load(const Node& texture, const Limits& limits) const {
    STX_TRY(const auto source, sourceOf(texture));
    return bytesOf(texture, source, limits);
}

Result<DecodedImage> StreamImages::decodeVideo(const ElementaryStream& stream, std::size_t sample,
                                               Samples samples, const Limits& limits) const {
    auto picture = video_->picture(stream, sample, limits);
    if (!picture && picture.error().code == ErrorCode::unsupported)
        return fail(ErrorCode::unsupported,
                    "the image is a stream of objectTypeIndication 0x{:02X}{}: {}. Take the "
                    "pictures out first (ffmpeg -i FILE picture_%04d.png); conversions between "
                    ".mp4, .bt and .xmt keep the stream",
                    stream.objectTypeIndication, videoName(stream.objectTypeIndication),
                    picture.error().message);
    if (!picture) return propagate(picture);
    DecodedImage out;
    out.width = out.displayWidth = picture->width();
    out.height = out.displayHeight = picture->height();
    if (samples == Samples::codes && picture->hasLuma()) {
        out.channels = 1;
        out.channelNames = {"Y"};
        auto codes = picture->lumaCodes();
        if (picture->bits() == 8) {
            out.values = std::vector<std::uint8_t>(codes.begin(), codes.end());
        } else {
            out.usedBits = picture->bits();
            out.values = std::move(codes);
        }
        return out;
    }
    out.colourNote = picture->notConverted();
    STX_TRY(const auto colour, picture->colour(limits));
    out.channels = 3;
    out.channelNames = {"R", "G", "B"};
    std::vector<std::uint8_t> values;
    values.reserve(colour.count() * 3);
    for (const glm::u8vec4 p : colour.pixels()) values.insert(values.end(), {p.r, p.g, p.b});
    out.values = std::move(values);
    return out;
}

Result<DecodedImage> StreamImages::decode(const Node& texture, const ImageDecoder& decoder,
                                          const Limits& limits, Samples samples) const {
    if (texture.is("PixelTexture")) {
        const auto& image = texture.get<PixelImage>("image");
        if (image.width < 1 || image.height < 1)
            return fail(ErrorCode::invalidInput, "the PixelTexture is empty");
        return decodedFromPixels(image);
    }
    STX_TRY(const auto source, sourceOf(texture));
    const ElementaryStream* from = source.stream;
    const PictureCache::Key key{from, from ? sampleAt(texture, *from) : 0,
                                samples == Samples::codes};
    if (cache_ && from)
        if (auto kept = cache_->find(key)) return *kept;
    const auto read = [&]() -> Result<DecodedImage> {
        if (from && isVideo(*from)) return decodeVideo(*from, key.sample, samples, limits);
        STX_TRY(const auto bytes, bytesOf(texture, source, limits));
        const Url& url = *source.url;
        return decoder(bytes,
                       url.text.empty() ? fmt::format("od:{}", url.objectDescriptorId) : url.text,
                       limits);
    };
    auto image = read();
    if (cache_ && from && image) cache_->keep(key, *image);
    return image;
}

Result<ImageInfo> StreamImages::probe(const Node& texture) const {
    if (texture.is("PixelTexture")) {
        const auto& image = texture.get<PixelImage>("image");
        return ImageInfo{"pixels", image.width, image.height, image.components, 8};
    }
    STX_TRY(const auto source, sourceOf(texture));
    if (const ElementaryStream* from = source.stream) {
        // Which channels video has, only its decoder knows; its track tells its size.
        if (isVideo(*from) && from->width > 0)
            return ImageInfo{"video", from->width, from->height, 1, lumaBits(*from) > 8 ? 16 : 8};
        // Headers are at the front, but for a JPEG with much metadata.
        ByteRange head = from->samples[sampleAt(texture, *from)].data;
        head.size = std::min<std::uint64_t>(head.size, 1 << 16);
        STX_TRY(const auto bytes, head.load(limits_));
        if (auto info = probeImage(bytes)) return info;
    }
    STX_TRY(const auto bytes, bytesOf(texture, source, limits_));
    return probeImage(bytes);
}

bool StreamImages::probesAsDecoded(const Node& texture) const {
    if (const ElementaryStream* from = stream(texture); from && isVideo(*from)) return false;
    return probe(texture).has_value();
}

}  // namespace stx::mpeg4
