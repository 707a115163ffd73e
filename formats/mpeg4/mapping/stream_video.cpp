#include "formats/mpeg4/mapping/stream_video.hpp"

#include <algorithm>

#include "formats/video/picture_finder.hpp"
#include "formats/video/video_process.hpp"

namespace stx::mpeg4 {
namespace {

/// Processes at a time: enough for colour and depth of the views of a film.
constexpr std::size_t kMostDecoders = 32;

}  // namespace

struct StreamVideo::Decoder {
    std::mutex mutex;
    std::uint64_t lastUse = 0;
    std::unique_ptr<VideoProcess> process;
    std::vector<CodedPicture> coded;
    std::optional<PictureFinder> finder;
};

StreamVideo::StreamVideo() = default;
StreamVideo::~StreamVideo() = default;

Result<std::shared_ptr<StreamVideo::Decoder>> StreamVideo::decoderOf(const ElementaryStream& stream,
                                                                     const Limits& limits) {
    const std::lock_guard lock(mutex_);
    auto& found = decoders_[&stream];
    if (found) {
        found->lastUse = ++uses_;
        return found;
    }
    endOne();
    auto decoder = std::make_shared<Decoder>();
    decoder->lastUse = ++uses_;
    const auto open = [&]() -> Result<void> {
        STX_TRY(decoder->process, VideoProcess::start(limits));
        video::Packer request;
        request.put(static_cast<std::int32_t>(stream.objectTypeIndication));
        request.putBytes(stream.decoderSpecificInfo);
        STX_TRY(const auto opened,
                decoder->process->ask(video::Tag::openStream, request.bytes, video::Tag::done));
        return {};
    };
    STX_CHECK(open());
    for (const Sample& sample : stream.samples)
        decoder->coded.push_back(
            {static_cast<std::int64_t>(sample.time) + sample.compositionOffset, sample.sync});
    PictureFinder::Source source;
    source.begin = [process = decoder->process.get()](std::size_t) -> Result<void> {
        STX_TRY(const auto done, process->ask(video::Tag::flush, {}, video::Tag::done));
        return {};
    };
    source.feed = [process = decoder->process.get(), &stream, limits](
                      std::size_t unit, std::int64_t wanted) -> Result<Bytes> {
        video::Packer request;
        if (unit >= stream.samples.size()) {
            request.put(wanted);
            return process->ask(video::Tag::end, request.bytes, video::Tag::ready);
        }
        const Sample& sample = stream.samples[unit];
        STX_TRY(const auto bytes, sample.data.load(limits));
        request.put(static_cast<std::int64_t>(sample.time) + sample.compositionOffset);
        request.put(wanted);
        request.add(bytes.data(), bytes.size());
        return process->ask(video::Tag::push, request.bytes, video::Tag::ready);
    };
    decoder->finder.emplace(*decoder->process, decoder->coded, std::move(source));
    found = decoder;
    return decoder;
}

void StreamVideo::endOne() {
    std::vector<std::shared_ptr<Decoder>*> running;
    for (auto& [stream, decoder] : decoders_)
        if (decoder) running.push_back(&decoder);
    if (running.size() < kMostDecoders) return;
    const auto [oldest, newest] =
        std::ranges::minmax_element(running, {}, [](const auto* one) { return (*one)->lastUse; });
    // Frames ask for all streams in turn: the one used longest ago is the next to be asked for. It
    // goes where it was left out of two turns.
    const bool leftOut = uses_ - (**oldest)->lastUse > 2 * decoders_.size();
    // One that another thread works with ends when that has its picture.
    (leftOut ? **oldest : **newest).reset();
}

Result<VideoPicture> StreamVideo::picture(const ElementaryStream& stream, std::size_t sample,
                                          const Limits& limits) {
    STX_TRY(const auto decoder, decoderOf(stream, limits));
    const std::lock_guard lock(decoder->mutex);
    return within(fmt::format("access unit {}", sample), decoder->finder->find(sample, limits));
}

}  // namespace stx::mpeg4
