#include "formats/images/foreign_decode.hpp"

#include "formats/images/picture_wire.hpp"
#include "formats/images/reader.hpp"

namespace stx {
namespace {

using decoders::Tag;

constexpr int kMostSeconds = 30;
constexpr std::uint64_t kLargestHeader = 1 << 20;

/// Room for the pixels that are to come, of a picture that is allowed; null when there is none.
Result<void*> prepare(ByteSpan content, std::size_t fileBytes, const Limits& limits,
                      DecodedImage& image) {
    decoders::Unpacker in(content);
    const auto facts = in.get<decoders::PictureFacts>();
    if (!in.ok() || (facts.bits != 8 && facts.bits != 16 && facts.bits != 32)) return nullptr;
    const ImageInfo claimed{"other", facts.width, facts.height, facts.channels, facts.bits};
    STX_CHECK(checkImageHeader(claimed, fileBytes, limits));
    for (int i = 0; i < facts.channels; ++i) image.channelNames.push_back(in.getText());
    if (!in.ok()) return nullptr;
    image.width = facts.width;
    image.height = facts.height;
    image.channels = facts.channels;
    image.originX = facts.originX;
    image.originY = facts.originY;
    image.displayWidth = facts.displayWidth;
    image.displayHeight = facts.displayHeight;
    image.linear = facts.linear != 0;
    image.storedLargest = facts.storedLargest;
    image.premultiplied = facts.premultiplied != 0;
    const auto count = static_cast<std::size_t>(facts.width) * facts.height * facts.channels;
    if (facts.bits == 8) return image.values.emplace<0>(count).data();
    if (facts.bits == 16) return image.values.emplace<1>(count).data();
    return image.values.emplace<2>(count).data();
}

}  // namespace

Result<DecodedImage> receivePicture(DecoderProcess& process, std::size_t fileBytes,
                                    const Limits& limits) {
    DecodedImage image;
    Tag tag{};
    Bytes content;
    if (!process.receiveMessage(tag, content, kLargestHeader)) return process.lost();
    if (tag == Tag::failure) return tl::unexpected(errorIn(content));
    if (tag != Tag::pictureHeader) return process.lost();
    STX_TRY(void* const values, prepare(content, fileBytes, limits, image));
    decoders::MessageHead head;
    if (!values || !process.receiveHead(head)) return process.lost();
    if (head.tag == Tag::failure && head.size <= kLargestHeader) {
        content.resize(head.size);
        if (!process.receive(content.data(), content.size())) return process.lost();
        return tl::unexpected(errorIn(content));
    }
    const std::size_t size =
        std::visit([](const auto& all) { return all.size() * sizeof(all[0]); }, image.values);
    if (head.tag != Tag::pixels || head.size != size || !process.receive(values, size))
        return process.lost();
    return image;
}

Result<DecodedImage> decodeForeign(ByteSpan bytes, std::string_view name, const Limits& limits) {
    DecoderBounds bounds;
    // The picture, what the library makes of it on the way, and what it keeps of its own.
    bounds.memoryBytes = limits.maxMemoryBytes + (limits.maxMemoryBytes >> 1) + (256u << 20);
    bounds.cpuSeconds = kMostSeconds;
    STX_TRY(const auto process, DecoderProcess::start(decoders::kImages, bounds, bytes));
    decoders::Packer request;
    request.putText(name);
    process->send(Tag::decodePicture, request.bytes);
    return receivePicture(*process, bytes.size(), limits);
}

}  // namespace stx
