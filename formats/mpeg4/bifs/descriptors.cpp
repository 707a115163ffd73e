#include "formats/mpeg4/bifs/descriptors.hpp"

#include "formats/files/byte_io.hpp"

namespace stx::mpeg4 {
namespace {

enum Tag : std::uint8_t {
    kObjectDescriptor = 0x01,
    kInitialObjectDescriptor = 0x02,
    kEsDescriptor = 0x03,
    kDecoderConfig = 0x04,
    kDecoderSpecificInfo = 0x05,
    kSlConfig = 0x06,
    kEsIdInc = 0x0E,
    kEsIdRef = 0x0F,
    kMp4InitialObjectDescriptor = 0x10,
    kMp4ObjectDescriptor = 0x11,
};

enum CommandTag : std::uint8_t {
    kOdUpdate = 0x01,
    kOdRemove = 0x02,
    kEsUpdate = 0x03,
    kEsRemove = 0x04,
    kEsRemoveRef = 0x07,
};

/// A tag, a length of 1 to 4 bytes, and that many bytes.
struct Descriptor {
    std::uint8_t tag = 0;
    ByteReader body;
};

std::string placeOf(std::uint8_t tag, std::uint64_t offset) {
    return fmt::format("descriptor {:#04x} at byte {}", tag, offset);
}

Result<Descriptor> readDescriptor(ByteReader& in) {
    const std::uint64_t start = in.offset();
    Descriptor descriptor;
    descriptor.tag = in.u8();
    std::uint32_t length = 0;
    for (int i = 0;; ++i) {
        if (i == 4)
            return failAt(placeOf(descriptor.tag, start), ErrorCode::invalidInput,
                          "the length of a descriptor has more than 4 bytes");
        const std::uint8_t byte = in.u8();
        length = length << 7 | (byte & 0x7F);
        if ((byte & 0x80) == 0) break;
    }
    if (in.failed() || length > in.left())
        return failAt(placeOf(descriptor.tag, start), ErrorCode::invalidInput,
                      "a descriptor of {} bytes does not fit into the {} bytes left", length,
                      in.left());
    descriptor.body = in.sub(length);
    return descriptor;
}

Result<void> finished(const ByteReader& in, std::uint8_t tag) {
    if (in.failed())
        return failAt(placeOf(tag, in.offset()), ErrorCode::invalidInput,
                      "the descriptor ends too early");
    return {};
}

void addDeviation(const DescriptorContext& context, Mp4Deviation::Kind kind, std::string text,
                  std::string where) {
    if (context.deviations != nullptr && context.deviations->size() < kMaxDeviations)
        context.deviations->push_back({kind, std::move(text), std::move(where)});
}

Result<void> readDecoderConfig(ByteReader in, ElementaryStream& stream) {
    stream.objectTypeIndication = in.u8();
    const std::uint8_t kind = in.u8();
    stream.streamType = static_cast<StreamType>(kind >> 2);
    stream.upStream = (kind & 2) != 0;
    stream.bufferSizeDB = in.u24();
    stream.maxBitrate = in.u32();
    stream.avgBitrate = in.u32();
    STX_CHECK(finished(in, kDecoderConfig));
    while (in.left() > 0) {
        STX_TRY(Descriptor part, readDescriptor(in));
        if (part.tag == kDecoderSpecificInfo) stream.decoderSpecificInfo = part.body.rest();
    }
    return {};
}

Result<ElementaryStream> readEsDescriptor(ByteReader in) {
    ElementaryStream stream;
    stream.esId = in.u16();
    const std::uint8_t flags = in.u8();
    stream.streamPriority = flags & 0x1F;
    if ((flags & 0x80) != 0) stream.dependsOnEsId = in.u16();
    if ((flags & 0x40) != 0) stream.url = in.text(in.u8());
    if ((flags & 0x20) != 0) stream.ocrEsId = in.u16();
    STX_CHECK(finished(in, kEsDescriptor));
    while (in.left() > 0) {
        STX_TRY(Descriptor part, readDescriptor(in));
        if (part.tag == kDecoderConfig) STX_CHECK(readDecoderConfig(part.body, stream));
    }
    return stream;
}

/// An ES_Descriptor or a reference to one; nothing for other descriptors and dangling references.
Result<std::optional<ElementaryStream>> readStream(const Descriptor& part,
                                                   const DescriptorContext& context) {
    ByteReader in = part.body;
    const std::string place = placeOf(part.tag, in.offset());
    if (part.tag == kEsDescriptor) {
        addDeviation(context, Mp4Deviation::Kind::fullEsdInOd,
                     "a whole ES_Descriptor stands where the file form has ES_ID_Ref", place);
        STX_TRY(ElementaryStream stream, readEsDescriptor(in));
        return stream;
    }
    if (part.tag == kEsIdInc) {
        ElementaryStream stream;
        stream.esId = in.u32();
        STX_CHECK(finished(in, part.tag));
        return stream;
    }
    if (part.tag != kEsIdRef) return std::nullopt;
    const std::uint16_t index = in.u16();
    STX_CHECK(finished(in, part.tag));
    if (index == 0 || index > context.mpod.size()) {
        addDeviation(
            context, Mp4Deviation::Kind::mpodMissing,
            fmt::format("ES_ID_Ref {} leads nowhere: the OD track's tref/mpod has {} entries",
                        index, context.mpod.size()),
            place);
        return std::nullopt;
    }
    ElementaryStream stream;
    stream.esId = context.mpod[index - 1u];
    return stream;
}

Result<ObjectDescriptor> readObjectDescriptor(const Descriptor& part,
                                              const DescriptorContext& context) {
    ByteReader in = part.body;
    if (part.tag == kObjectDescriptor)
        addDeviation(context, Mp4Deviation::Kind::streamOdTag,
                     "an object descriptor has tag 0x01; the file form is 0x11",
                     placeOf(part.tag, in.offset()));
    ObjectDescriptor descriptor;
    const std::uint16_t head = in.u16();
    descriptor.id = head >> 6;
    if ((head & 0x20) != 0) descriptor.url = in.text(in.u8());
    STX_CHECK(finished(in, part.tag));
    while (in.left() > 0) {
        STX_TRY(Descriptor inner, readDescriptor(in));
        STX_TRY(auto stream, readStream(inner, context));
        if (stream) descriptor.streams.push_back(std::move(*stream));
    }
    return descriptor;
}

Result<OdCommand> readCommand(const Descriptor& command, const DescriptorContext& context) {
    ByteReader in = command.body;
    switch (command.tag) {
        case kOdUpdate: {
            UpdateObjectDescriptors update;
            while (in.left() > 0) {
                STX_TRY(Descriptor part, readDescriptor(in));
                if (part.tag != kObjectDescriptor && part.tag != kMp4ObjectDescriptor) continue;
                STX_TRY(ObjectDescriptor descriptor, readObjectDescriptor(part, context));
                update.descriptors.push_back(std::move(descriptor));
            }
            return update;
        }
        case kOdRemove: {
            RemoveObjectDescriptors removal;
            std::uint32_t window = 0;
            for (int held = 0; in.left() > 0;) {
                window = window << 8 | in.u8();
                held += 8;
                if (held < 10) continue;
                held -= 10;
                removal.ids.push_back(static_cast<int>(window >> held & 0x3FF));
            }
            return removal;
        }
        case kEsUpdate: {
            UpdateStreams update;
            update.objectDescriptorId = in.u16() >> 6;
            STX_CHECK(finished(in, command.tag));
            while (in.left() > 0) {
                STX_TRY(Descriptor part, readDescriptor(in));
                STX_TRY(auto stream, readStream(part, context));
                if (stream) update.streams.push_back(std::move(*stream));
            }
            return update;
        }
        case kEsRemove:
        case kEsRemoveRef: {
            RemoveStreams removal;
            removal.objectDescriptorId = in.u16() >> 6;
            STX_CHECK(finished(in, command.tag));
            while (in.left() >= 2) {
                const std::uint16_t value = in.u16();
                if (command.tag == kEsRemove) {
                    removal.esIds.push_back(value);
                } else if (value >= 1 && value <= context.mpod.size()) {
                    removal.esIds.push_back(context.mpod[value - 1u]);
                } else {
                    addDeviation(context, Mp4Deviation::Kind::mpodMissing,
                                 fmt::format("ES_DescriptorRemoveRef {} leads nowhere", value),
                                 placeOf(command.tag, in.offset()));
                }
            }
            return removal;
        }
        default:
            return OtherOdCommand{command.tag, in.rest()};
    }
}

// ---- writing

Bytes describe(std::uint8_t tag, const ByteWriter& body) {
    ByteWriter out;
    out.u8(tag);
    const auto length = static_cast<std::uint32_t>(body.size());
    for (int shift = 21; shift > 0; shift -= 7)
        if (length >> shift != 0)
            out.u8(static_cast<std::uint8_t>(0x80 | (length >> shift & 0x7F)));
    out.u8(static_cast<std::uint8_t>(length & 0x7F));
    out.bytes(body.view());
    return out.take();
}

Result<void> checkLength(const ByteWriter& body, std::string_view what) {
    if (body.size() >= 1u << 28)
        return fail(ErrorCode::invalidInput, "{} of {} bytes is too long", what, body.size());
    return {};
}

Result<void> writeUrl(ByteWriter& out, const std::string& url) {
    if (url.size() > 255)
        return fail(ErrorCode::invalidInput,
                    "the URL of a descriptor has {} bytes; 255 are possible", url.size());
    out.u8(static_cast<std::uint8_t>(url.size()));
    out.text(url);
    return {};
}

Result<void> checkId(int id) {
    if (id < 1 || id > 1022)
        return fail(ErrorCode::invalidInput, "object descriptor id {} is outside 1 to 1022", id);
    return {};
}

using ReferenceOf = std::function<std::uint32_t(std::uint32_t)>;

Result<Bytes> encodeReference(std::uint32_t esId, const ReferenceOf& referenceOf) {
    const std::uint32_t reference = referenceOf(esId);
    if (reference == 0 || reference > 0xFFFF)
        return fail(ErrorCode::invalidInput, "stream {} has no place in tref/mpod (reference {})",
                    esId, reference);
    ByteWriter body;
    body.u16(static_cast<std::uint16_t>(reference));
    return describe(kEsIdRef, body);
}

Result<Bytes> encodeObjectDescriptor(const ObjectDescriptor& descriptor,
                                     const ReferenceOf& referenceOf) {
    STX_CHECK(checkId(descriptor.id));
    ByteWriter body;
    body.u16(static_cast<std::uint16_t>(descriptor.id << 6 | (descriptor.url.empty() ? 0 : 0x20) |
                                        0x1F));
    if (!descriptor.url.empty()) STX_CHECK(writeUrl(body, descriptor.url));
    for (const ElementaryStream& stream : descriptor.streams) {
        STX_TRY(const Bytes reference, encodeReference(stream.esId, referenceOf));
        body.bytes(reference);
    }
    STX_CHECK(checkLength(body, "an object descriptor"));
    return describe(kMp4ObjectDescriptor, body);
}

struct CommandEncoder {
    const ReferenceOf& referenceOf;

    Result<Bytes> operator()(const UpdateObjectDescriptors& update) const {
        ByteWriter body;
        for (const ObjectDescriptor& descriptor : update.descriptors) {
            STX_TRY(const Bytes bytes, encodeObjectDescriptor(descriptor, referenceOf));
            body.bytes(bytes);
        }
        STX_CHECK(checkLength(body, "an OD command"));
        return describe(kOdUpdate, body);
    }
    Result<Bytes> operator()(const RemoveObjectDescriptors& removal) const {
        ByteWriter body;
        std::uint32_t window = 0;
        int held = 0;
        for (const int id : removal.ids) {
            STX_CHECK(checkId(id));
            window = window << 10 | static_cast<std::uint32_t>(id);
            for (held += 10; held >= 8; held -= 8)
                body.u8(static_cast<std::uint8_t>(window >> (held - 8)));
        }
        if (held > 0) body.u8(static_cast<std::uint8_t>(window << (8 - held)));
        STX_CHECK(checkLength(body, "an OD command"));
        return describe(kOdRemove, body);
    }
    Result<Bytes> operator()(const UpdateStreams& update) const {
        STX_CHECK(checkId(update.objectDescriptorId));
        ByteWriter body;
        body.u16(static_cast<std::uint16_t>(update.objectDescriptorId << 6));
        for (const ElementaryStream& stream : update.streams) {
            STX_TRY(const Bytes reference, encodeReference(stream.esId, referenceOf));
            body.bytes(reference);
        }
        return describe(kEsUpdate, body);
    }
    Result<Bytes> operator()(const RemoveStreams& removal) const {
        STX_CHECK(checkId(removal.objectDescriptorId));
        ByteWriter body;
        body.u16(static_cast<std::uint16_t>(removal.objectDescriptorId << 6));
        for (const std::uint32_t esId : removal.esIds) {
            const std::uint32_t reference = referenceOf(esId);
            if (reference == 0 || reference > 0xFFFF)
                return fail(ErrorCode::invalidInput, "stream {} has no place in tref/mpod", esId);
            body.u16(static_cast<std::uint16_t>(reference));
        }
        return describe(kEsRemoveRef, body);
    }
    Result<Bytes> operator()(const OtherOdCommand& other) const {
        ByteWriter body;
        body.bytes(other.body);
        STX_CHECK(checkLength(body, "an OD command"));
        return describe(other.tag, body);
    }
};

}  // namespace

Result<std::vector<OdCommand>> decodeOdFrame(ByteSpan accessUnit,
                                             const DescriptorContext& context) {
    ByteReader in(accessUnit);
    std::vector<OdCommand> commands;
    while (in.left() > 0) {
        STX_TRY(const Descriptor command, readDescriptor(in));
        STX_TRY(OdCommand decoded, readCommand(command, context));
        commands.push_back(std::move(decoded));
    }
    return commands;
}

Result<Bytes> encodeOdFrame(const std::vector<OdCommand>& commands,
                            const ReferenceOf& referenceOf) {
    ByteWriter out;
    for (const OdCommand& command : commands) {
        STX_TRY(const Bytes bytes, std::visit(CommandEncoder{referenceOf}, command));
        out.bytes(bytes);
    }
    return out.take();
}

Result<DecodedIod> decodeIod(ByteSpan bytes, const DescriptorContext& context) {
    ByteReader in(bytes);
    STX_TRY(const Descriptor descriptor, readDescriptor(in));
    if (descriptor.tag != kMp4InitialObjectDescriptor && descriptor.tag != kInitialObjectDescriptor)
        return failAt(placeOf(descriptor.tag, 0), ErrorCode::invalidInput,
                      "an initial object descriptor is expected (tag 0x10 or 0x02)");
    in = descriptor.body;
    if (descriptor.tag == kInitialObjectDescriptor)
        addDeviation(context, Mp4Deviation::Kind::streamOdTag,
                     "the IOD has tag 0x02; the file form is 0x10", placeOf(descriptor.tag, 0));
    DecodedIod decoded;
    InitialObjectDescriptor& iod = decoded.iod;
    const std::uint16_t head = in.u16();
    iod.id = head >> 6;
    iod.includeInlineProfileLevel = (head & 0x10) != 0;
    if ((head & 0x20) != 0) {
        iod.url = in.text(in.u8());
    } else {
        iod.odProfileLevel = in.u8();
        iod.sceneProfileLevel = in.u8();
        iod.audioProfileLevel = in.u8();
        iod.visualProfileLevel = in.u8();
        iod.graphicsProfileLevel = in.u8();
    }
    STX_CHECK(finished(in, descriptor.tag));
    while (in.left() > 0) {
        STX_TRY(const Descriptor part, readDescriptor(in));
        ByteReader body = part.body;
        if (part.tag == kEsIdInc) decoded.trackIds.push_back(body.u32());
        if (part.tag == kEsDescriptor) decoded.trackIds.push_back(body.u16());
        STX_CHECK(finished(body, part.tag));
    }
    return decoded;
}

Result<Bytes> encodeIod(const InitialObjectDescriptor& iod,
                        std::span<const std::uint32_t> trackIds) {
    if (iod.id < 1 || iod.id > 1023)
        return fail(ErrorCode::invalidInput,
                    "the id {} of the initial object descriptor is outside 1 to 1023", iod.id);
    ByteWriter body;
    body.u16(static_cast<std::uint16_t>(iod.id << 6 | (iod.url.empty() ? 0 : 0x20) |
                                        (iod.includeInlineProfileLevel ? 0x10 : 0) | 0x0F));
    if (!iod.url.empty()) {
        STX_CHECK(writeUrl(body, iod.url));
    } else {
        body.u8(iod.odProfileLevel);
        body.u8(iod.sceneProfileLevel);
        body.u8(iod.audioProfileLevel);
        body.u8(iod.visualProfileLevel);
        body.u8(iod.graphicsProfileLevel);
    }
    for (const std::uint32_t trackId : trackIds) {
        ByteWriter inc;
        inc.u32(trackId);
        body.bytes(describe(kEsIdInc, inc));
    }
    return describe(kMp4InitialObjectDescriptor, body);
}

Result<ElementaryStream> decodeEsDescriptor(ByteSpan bytes) {
    ByteReader in(bytes);
    STX_TRY(const Descriptor descriptor, readDescriptor(in));
    if (descriptor.tag != kEsDescriptor)
        return failAt(placeOf(descriptor.tag, 0), ErrorCode::invalidInput,
                      "an ES_Descriptor (tag 0x03) is expected");
    return readEsDescriptor(descriptor.body);
}

Result<Bytes> encodeEsDescriptor(const ElementaryStream& stream) {
    ByteWriter info;
    info.bytes(stream.decoderSpecificInfo);
    STX_CHECK(checkLength(info, "the decoder specific info"));
    ByteWriter config;
    config.u8(stream.objectTypeIndication);
    config.u8(static_cast<std::uint8_t>(static_cast<unsigned>(stream.streamType) << 2 |
                                        (stream.upStream ? 2 : 0) | 1));
    config.u24(stream.bufferSizeDB);
    config.u32(stream.maxBitrate);
    config.u32(stream.avgBitrate);
    if (!stream.decoderSpecificInfo.empty()) config.bytes(describe(kDecoderSpecificInfo, info));

    ByteWriter body;
    body.u16(0);
    body.u8(static_cast<std::uint8_t>(
        (stream.dependsOnEsId ? 0x80 : 0) | (stream.url.empty() ? 0 : 0x40) |
        (stream.ocrEsId ? 0x20 : 0) | (stream.streamPriority & 0x1F)));
    if (stream.dependsOnEsId) body.u16(*stream.dependsOnEsId);
    if (!stream.url.empty()) STX_CHECK(writeUrl(body, stream.url));
    if (stream.ocrEsId) body.u16(*stream.ocrEsId);
    body.bytes(describe(kDecoderConfig, config));
    ByteWriter sl;
    sl.u8(2);
    body.bytes(describe(kSlConfig, sl));
    STX_CHECK(checkLength(body, "an ES_Descriptor"));
    return describe(kEsDescriptor, body);
}

}  // namespace stx::mpeg4
