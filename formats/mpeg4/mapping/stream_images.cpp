#include "formats/mpeg4/mapping/stream_images.hpp"

#include "formats/mpeg4/mapping/texture_images.hpp"
#include "formats/mpeg4/text/text_values.hpp"

namespace stx::mpeg4 {
namespace {

const std::vector<Url>* urlsOf(const Node& texture) {
    const int index = texture.info->find("url");
    return index < 0 ? nullptr : std::get_if<std::vector<Url>>(&texture.value(index));
}

}  // namespace

Result<StreamImages> StreamImages::make(const Document& document,
                                        const std::filesystem::path& folder, const Limits& limits) {
    StreamImages images;
    images.folder_ = folder;
    images.limits_ = limits;
    for (const ObjectDescriptor* od : document.objectDescriptors()) images.byId_[od->id] = od;
    if (!document.frames.empty() && !document.odFrames.empty()) {
        const double start =
            static_cast<double>(document.frames[0].time) / document.sceneStream.timescale;
        const auto ticks = static_cast<std::uint64_t>(start * document.odStream.timescale);
        for (const ObjectDescriptor* od : document.objectDescriptors(ticks))
            images.byId_[od->id] = od;
    }
    return images;
}

const ElementaryStream* StreamImages::stream(const Node& texture) const {
    const auto* urls = urlsOf(texture);
    if (!urls) return nullptr;
    for (const Url& url : *urls) {
        const auto found = byId_.find(url.objectDescriptorId);
        if (found != byId_.end() && !found->second->streams.empty())
            return &found->second->streams[0];
    }
    return nullptr;
}

Result<Bytes> StreamImages::load(const Node& texture, const Limits& limits) const {
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
        if (url.objectDescriptorId == 0) {
            if (folder_.empty()) {
                last = {ErrorCode::invalidInput,
                        fmt::format("the url '{}' is no object descriptor", excerpt(url.text)),
                        {}};
                continue;
            }
            auto path = resolveInside(folder_, url.text, limits);
            if (!path) {
                last = path.error();
                continue;
            }
            return readFile(*path, limits);
        }
        const auto found = byId_.find(url.objectDescriptorId);
        if (found == byId_.end()) {
            last = {ErrorCode::invalidInput,
                    fmt::format("there is no object descriptor {}", url.objectDescriptorId),
                    {}};
            continue;
        }
        const ObjectDescriptor& od = *found->second;
        if (od.streams.empty() || od.streams[0].samples.empty()) {
            last = {
                ErrorCode::invalidInput,
                fmt::format("object descriptor {} has no stream with an image in this file", od.id),
                {}};
            continue;
        }
        const Sample& sample = od.streams[0].samples[0];
        if (sample.data.size == 0) {
            last = {ErrorCode::invalidInput,
                    fmt::format("the image '{}' of object descriptor {} was not loaded",
                                excerpt(od.streams[0].fileName), od.id),
                    {}};
            continue;
        }
        return sample.data.load(limits);
    }
    return tl::unexpected(last);
}

Result<DecodedImage> StreamImages::decode(const Node& texture, const ImageDecoder& decoder,
                                          const Limits& limits) const {
    if (texture.is("PixelTexture")) {
        const auto& image = texture.get<PixelImage>("image");
        if (image.width < 1 || image.height < 1)
            return fail(ErrorCode::invalidInput, "the PixelTexture is empty");
        return decodedFromPixels(image);
    }
    if (const ElementaryStream* from = stream(texture); from && from->objectTypeIndication != 0 &&
                                                        from->objectTypeIndication != oti::kJpeg &&
                                                        from->objectTypeIndication != oti::kPng)
        return fail(ErrorCode::unsupported,
                    "the image is a stream of objectTypeIndication 0x{:02X}; JPEG (0x6C) and PNG "
                    "(0x6D) are read",
                    from->objectTypeIndication);
    STX_TRY(const auto bytes, load(texture, limits));
    const auto* urls = urlsOf(texture);
    const Url& url = urls->front();
    return decoder(
        bytes, url.text.empty() ? fmt::format("od:{}", url.objectDescriptorId) : url.text, limits);
}

Result<ImageInfo> StreamImages::probe(const Node& texture) const {
    if (texture.is("PixelTexture")) {
        const auto& image = texture.get<PixelImage>("image");
        return ImageInfo{"pixels", image.width, image.height, image.components, 8};
    }
    // Headers are at the front, but for a JPEG with much metadata.
    if (const ElementaryStream* from = stream(texture); from && !from->samples.empty()) {
        ByteRange head = from->samples[0].data;
        head.size = std::min<std::uint64_t>(head.size, 1 << 16);
        STX_TRY(const auto bytes, head.load(limits_));
        if (auto info = probeImage(bytes)) return info;
    }
    STX_TRY(const auto bytes, load(texture, limits_));
    return probeImage(bytes);
}

}  // namespace stx::mpeg4
