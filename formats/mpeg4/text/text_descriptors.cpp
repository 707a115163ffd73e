#include "formats/mpeg4/text/text_descriptors.hpp"

#include <cmath>

#include "formats/files/no_case.hpp"
#include "formats/mpeg4/text/text_values.hpp"
#include "lib/base/whole_number.hpp"

namespace stx::mpeg4 {
namespace {

constexpr int kMaxSamples = 1 << 20;

/// Reads number fields of a descriptor; the first that makes no sense is kept as the error.
class Fields {
  public:
    explicit Fields(const TextDescriptor& descriptor) : descriptor_(descriptor) {}

    template <class T>
    void integer(std::initializer_list<std::string_view> names, T& out, std::int64_t highest) {
        const auto* field = descriptor_.find(names);
        if (!field) return;
        const auto value = integerFromText(field->value);
        if (!value || *value < 0 || *value > highest) {
            bad(*field, fmt::format("a number from 0 to {}", highest));
            return;
        }
        out = static_cast<T>(*value);
    }
    void boolean(std::initializer_list<std::string_view> names, bool& out) {
        const auto* field = descriptor_.find(names);
        if (!field) return;
        if (const auto value = boolFromText(field->value)) {
            out = *value;
        } else {
            bad(*field, "true or false");
        }
    }
    void real(std::initializer_list<std::string_view> names, double& out) {
        const auto* field = descriptor_.find(names);
        if (!field) return;
        const auto value = doubleFromText(field->value);
        if (value && std::isfinite(*value) && *value >= 0) {
            out = *value;
        } else {
            bad(*field, "a number of 0 or more");
        }
    }
    void text(std::initializer_list<std::string_view> names, std::string& out) {
        if (const auto* field = descriptor_.find(names)) out = field->value;
    }
    void bad(const TextDescriptor::Field& field, std::string_view expected) {
        if (error_) return;
        error_ = Error{ErrorCode::invalidInput,
                       fmt::format("{} of {} is '{}', expected {}", field.name, descriptor_.type,
                                   excerpt(field.value), expected),
                       field.where};
    }
    [[nodiscard]] Result<void> result() const {
        if (error_) return tl::unexpected(*error_);
        return {};
    }

  private:
    const TextDescriptor& descriptor_;
    std::optional<Error> error_;
};

struct NamedNumber {
    std::string_view name;
    int number;
};
constexpr NamedNumber kObjectTypes[] = {
    {"JPEG", 0x6C},       {"PNG", 0x6D},         {"MPEG4Systems1", 1},
    {"MPEG4Systems2", 2}, {"MPEG4Visual", 0x20}, {"Unspecified", 0xFF},
};
constexpr NamedNumber kStreamTypes[] = {
    {"ObjectDescriptor", 1},
    {"ClockReference", 2},
    {"SceneDescription", 3},
    {"Visual", 4},
    {"Audio", 5},
    {"MPEG7", 6},
    {"IPMP", 7},
    {"OCI", 8},
    {"MPEGJ", 9},
    {"Interaction", 10},
};

template <class T, std::size_t N>
void namedNumber(Fields& fields, const TextDescriptor& d, std::string_view name,
                 const NamedNumber (&table)[N], int highest, T& out) {
    const auto* field = d.find({name});
    if (!field) return;
    for (const NamedNumber& entry : table) {
        if (equalNoCase(field->value, entry.name)) {
            out = static_cast<T>(entry.number);
            return;
        }
    }
    int number = 0;
    fields.integer({name}, number, highest);
    out = static_cast<T>(number);
}

Result<std::optional<std::uint32_t>> idOf(const TextDescriptor& d,
                                          std::initializer_list<std::string_view> names,
                                          const TextIds& ids, std::uint32_t highest) {
    const auto* field = d.find(names);
    if (!field) return std::optional<std::uint32_t>();
    const auto number = numberOfTextId(field->value, ids);
    if (!number || *number > highest)
        return failAt(field->where, ErrorCode::invalidInput,
                      "{} of {} is '{}', expected a number from 0 to {}", field->name, d.type,
                      excerpt(field->value), highest);
    return number;
}

Result<void> readDecoderConfig(const TextDescriptor& d, ElementaryStream& stream) {
    Fields fields(d);
    namedNumber(fields, d, "objectTypeIndication", kObjectTypes, 255, stream.objectTypeIndication);
    namedNumber(fields, d, "streamType", kStreamTypes, 63, stream.streamType);
    fields.boolean({"upStream"}, stream.upStream);
    fields.integer({"bufferSizeDB"}, stream.bufferSizeDB, 0xFFFFFF);
    fields.integer({"maxBitrate"}, stream.maxBitrate, 0xFFFFFFFF);
    fields.integer({"avgBitrate"}, stream.avgBitrate, 0xFFFFFFFF);
    if (const auto* info = d.child({"DecoderSpecificInfo"})) {
        if (const auto* field = info->find({"info", "src"})) {
            std::string_view text = field->value;
            if (const auto comma = text.find(','); text.starts_with("data:") && comma != text.npos)
                text.remove_prefix(comma + 1);
            if (auto bytes = bytesFromPercentText(text)) {
                stream.decoderSpecificInfo = std::move(*bytes);
            } else {
                fields.bad(*field, "bytes as %00%14");
            }
        }
    }
    return fields.result();
}

Result<void> readMux(const TextDescriptor& d, ElementaryStream& stream) {
    Fields fields(d);
    fields.text({"fileName", "url"}, stream.fileName);
    double startMs = 0, durationMs = -1, frameRate = 0;
    fields.real({"startTime"}, startMs);
    fields.real({"duration"}, durationMs);
    fields.real({"frameRate"}, frameRate);
    STX_CHECK(fields.result());
    if (stream.fileName.empty()) return {};

    std::int64_t count = 1;
    double seconds = durationMs < 0 ? 1.0 : durationMs / 1000;
    if (frameRate > 0 && stream.fileName.find('%') != std::string::npos) {
        const double frames = std::nearbyint(seconds * frameRate);
        if (durationMs < 0 || !(frames >= 1 && frames <= kMaxSamples))
            return failAt(
                d.where, ErrorCode::invalidInput,
                "'{}' at {:g} images a second lasts {:g} ms, which is not a number of images "
                "from 1 to {}",
                excerpt(stream.fileName), frameRate, durationMs, kMaxSamples);
        count = static_cast<std::int64_t>(frames);
        seconds = 1.0 / frameRate;
    }
    const double start = std::nearbyint(startMs / 1000 * stream.timescale);
    const auto ticksOf = [&](std::int64_t images) {
        return std::nearbyint(static_cast<double>(images) * seconds * stream.timescale);
    };
    const double ticks = seconds * stream.timescale;
    if (start > 1e15 || ticks > 4294967295.0)
        return failAt(d.where, ErrorCode::invalidInput,
                      "the times of '{}' do not fit: {:g} + {:g} ticks", excerpt(stream.fileName),
                      start, ticks);
    for (std::int64_t i = 0; i < count; ++i) {
        Sample sample;
        sample.duration = static_cast<std::uint32_t>(ticksOf(i + 1) - ticksOf(i));
        sample.time = static_cast<std::uint64_t>(start + ticksOf(i));
        stream.samples.push_back(sample);
    }
    return {};
}

}  // namespace

const TextDescriptor::Field* TextDescriptor::find(
    std::initializer_list<std::string_view> names) const {
    for (const std::string_view name : names)
        for (const Field& field : fields)
            if (equalNoCase(field.name, name)) return &field;
    return nullptr;
}

const TextDescriptor* TextDescriptor::child(std::initializer_list<std::string_view> types) const {
    for (const std::string_view wanted : types)
        for (const TextDescriptor& d : children)
            if (equalNoCase(d.type, wanted)) return &d;
    return nullptr;
}

bool isDescriptorType(std::string_view type) {
    for (const std::string_view known :
         {"InitialObjectDescriptor", "ObjectDescriptor", "ES_Descriptor", "DecoderConfigDescriptor",
          "BIFSConfig", "BIFSv2Config", "DecoderSpecificInfo", "SLConfigDescriptor", "MuxInfo",
          "StreamSource"}) {
        if (equalNoCase(type, known)) return true;
    }
    return false;
}

void collectTextIds(const TextDescriptor& d, TextIds& odIds, TextIds& esIds) {
    const auto* binary = d.find({"binaryID"});
    const bool isStream = equalNoCase(d.type, "ES_Descriptor");
    const auto* text = d.find({isStream ? "ES_ID" : "objectDescriptorID"});
    if (binary && text) {
        if (const auto number = integerFromText(binary->value);
            number && *number >= 0 && *number <= 0xFFFF)
            (isStream ? esIds : odIds)[text->value] = static_cast<std::uint32_t>(*number);
    }
    for (const TextDescriptor& child : d.children) collectTextIds(child, odIds, esIds);
}

std::optional<std::uint32_t> numberOfTextId(std::string_view text, const TextIds& ids) {
    if (const auto found = ids.find(text); found != ids.end()) return found->second;
    if (const auto number = integerFromText(text); number && *number >= 0 && *number <= 0xFFFFFFFF)
        return static_cast<std::uint32_t>(*number);
    // "od10", "es10": what other tools write, meaning 10.
    if (text.size() > 2 &&
        (equalNoCase(text.substr(0, 2), "od") || equalNoCase(text.substr(0, 2), "es")))
        return wholeNumber<std::uint32_t>(text.substr(2));
    return {};
}

Result<ElementaryStream> streamFromText(const TextDescriptor& d, const TextIds& esIds) {
    ElementaryStream stream;
    Fields fields(d);
    STX_TRY(const auto id, idOf(d, {"binaryID", "ES_ID"}, esIds, 0xFFFF));
    stream.esId = id.value_or(0);
    STX_TRY(const auto ocr, idOf(d, {"OCR_ES_ID"}, esIds, 0xFFFF));
    if (ocr) stream.ocrEsId = static_cast<std::uint16_t>(*ocr);
    STX_TRY(const auto depends, idOf(d, {"dependsOn_ES_ID", "dependsOnESID"}, esIds, 0xFFFF));
    if (depends) stream.dependsOnEsId = static_cast<std::uint16_t>(*depends);
    fields.integer({"streamPriority"}, stream.streamPriority, 31);
    fields.text({"URLstring", "url"}, stream.url);
    STX_CHECK(fields.result());
    if (const auto* config = d.child({"DecoderConfigDescriptor"}))
        STX_CHECK(readDecoderConfig(*config, stream));
    if (const auto* sl = d.child({"SLConfigDescriptor"})) {
        Fields slFields(*sl);
        slFields.integer({"timeStampResolution"}, stream.timescale, 0xFFFFFFFF);
        STX_CHECK(slFields.result());
        if (stream.timescale == 0)
            return failAt(sl->where, ErrorCode::invalidInput,
                          "timeStampResolution is 0, expected at least 1");
    }
    if (const auto* mux = d.child({"MuxInfo", "StreamSource"})) STX_CHECK(readMux(*mux, stream));
    return stream;
}

Result<ObjectDescriptor> objectDescriptorFromText(const TextDescriptor& d, const TextIds& odIds,
                                                  const TextIds& esIds) {
    ObjectDescriptor od;
    STX_TRY(const auto id, idOf(d, {"binaryID", "objectDescriptorID"}, odIds, 1023));
    if (!id || *id == 0 || *id == 1023)
        return failAt(d.where, ErrorCode::invalidInput,
                      "an ObjectDescriptor has {}; objectDescriptorID 1 to 1022 is possible",
                      id ? fmt::format("the id {}", *id) : "no objectDescriptorID");
    od.id = static_cast<int>(*id);
    if (const auto* url = d.find({"URLstring", "url"})) od.url = url->value;
    for (const TextDescriptor& child : d.children) {
        if (!equalNoCase(child.type, "ES_Descriptor")) continue;
        STX_TRY(auto stream, streamFromText(child, esIds));
        od.streams.push_back(std::move(stream));
    }
    return od;
}

Result<void> initialDescriptorFromText(const TextDescriptor& d, const TextIds& odIds,
                                       const TextIds& esIds, Document& document, Job& job) {
    InitialObjectDescriptor& iod = document.iod;
    STX_TRY(const auto id, idOf(d, {"binaryID", "objectDescriptorID"}, odIds, 1023));
    if (id) iod.id = static_cast<int>(*id);
    Fields fields(d);
    fields.integer({"ODProfileLevelIndication"}, iod.odProfileLevel, 255);
    fields.integer({"sceneProfileLevelIndication"}, iod.sceneProfileLevel, 255);
    fields.integer({"audioProfileLevelIndication"}, iod.audioProfileLevel, 255);
    fields.integer({"visualProfileLevelIndication"}, iod.visualProfileLevel, 255);
    fields.integer({"graphicsProfileLevelIndication"}, iod.graphicsProfileLevel, 255);
    fields.boolean({"includeInlineProfileLevelFlag", "includeInlineProfilesFlag"},
                   iod.includeInlineProfileLevel);
    fields.text({"URLstring", "url"}, iod.url);
    STX_CHECK(fields.result());

    bool haveScene = false, haveOd = false;
    for (const TextDescriptor& child : d.children) {
        if (!equalNoCase(child.type, "ES_Descriptor")) continue;
        STX_TRY(auto stream, streamFromText(child, esIds));
        if (stream.streamType == StreamType::sceneDescription && !haveScene) {
            haveScene = true;
            document.sceneStream = std::move(stream);
            document.sceneStream.samples.clear();
            const auto* decoder = child.child({"DecoderConfigDescriptor"});
            const auto* config = decoder ? decoder->child({"BIFSConfig", "BIFSv2Config"}) : nullptr;
            if (!config) continue;
            BifsConfig& bifs = document.bifsConfig;
            Fields f(*config);
            bifs.version = equalNoCase(config->type, "BIFSv2Config") ? 2 : 1;
            f.boolean({"use3DMeshCoding"}, bifs.use3DMeshCoding);
            f.boolean({"usePredictiveMFField"}, bifs.usePredictiveMFField);
            f.integer({"nodeIDbits"}, bifs.nodeIdBits, 31);
            f.integer({"routeIDbits"}, bifs.routeIdBits, 31);
            f.integer({"protoIDbits"}, bifs.protoIdBits, 31);
            f.boolean({"isCommandStream"}, bifs.isCommandStream);
            f.boolean({"pixelMetric"}, bifs.pixelMetric);
            f.integer({"pixelWidth"}, bifs.pixelWidth, 65535);
            f.integer({"pixelHeight"}, bifs.pixelHeight, 65535);
            bifs.hasSize = config->find({"pixelWidth", "pixelHeight"}) != nullptr;
            STX_CHECK(f.result());
            if (!bifs.isCommandStream)
                return failAt(
                    config->where, ErrorCode::unsupported,
                    "the scene stream is an animation stream (isCommandStream false); only "
                    "command streams are read");
        } else if (stream.streamType == StreamType::objectDescriptor && !haveOd) {
            haveOd = true;
            document.odStream = std::move(stream);
            document.odStream.samples.clear();
        } else {
            job.note(
                fmt::format("stream {} of the InitialObjectDescriptor (streamType {}) is left out",
                            stream.esId, static_cast<int>(stream.streamType)));
        }
    }
    return {};
}

std::string percentText(ByteSpan bytes) {
    std::string text;
    for (const std::byte b : bytes)
        fmt::format_to(std::back_inserter(text), "%{:02X}", std::to_integer<int>(b));
    return text;
}

std::optional<Bytes> bytesFromPercentText(std::string_view text) {
    Bytes bytes;
    for (std::size_t i = 0; i < text.size();) {
        if (text[i] != '%') {
            bytes.push_back(static_cast<std::byte>(text[i++]));
            continue;
        }
        if (text.size() - i < 3) return {};
        const auto value = wholeNumber<unsigned>(text.substr(i + 1, 2), 16);
        if (!value) return {};
        bytes.push_back(static_cast<std::byte>(*value));
        i += 3;
    }
    return bytes;
}

MuxTimes muxTimes(const ElementaryStream& stream) {
    MuxTimes times;
    // A track of an .mp4 has its own times.
    if (stream.samples.empty() || stream.fileName.find('#') != std::string::npos) return times;
    const double tick = 1000.0 / stream.timescale;
    times.startMs = static_cast<double>(stream.samples[0].time) * tick;
    times.durationMs = static_cast<double>(stream.samples[0].duration) * tick *
                       static_cast<double>(stream.samples.size());
    if (stream.samples.size() > 1 && stream.samples[0].duration > 0)
        times.frameRate = static_cast<double>(stream.timescale) / stream.samples[0].duration;
    return times;
}

ElementaryStream sceneStreamForText(const Document& document) {
    ElementaryStream stream = document.sceneStream;
    stream.streamType = StreamType::sceneDescription;
    if (stream.objectTypeIndication == 0)
        stream.objectTypeIndication =
            document.bifsConfig.version == 2 ? oti::kSystemsV2 : oti::kSystemsV1;
    stream.samples.clear();
    return stream;
}

bool hasOdStream(const Document& document) {
    return !document.odFrames.empty() || document.odStream.esId != 0;
}

ElementaryStream odStreamForText(const Document& document) {
    ElementaryStream stream = document.odStream;
    stream.streamType = StreamType::objectDescriptor;
    if (stream.objectTypeIndication == 0) stream.objectTypeIndication = oti::kSystemsV1;
    stream.samples.clear();
    return stream;
}

std::vector<std::string> sampleFileNames(const ElementaryStream& stream) {
    const std::string& name = stream.fileName;
    const auto percent = name.find('%');
    if (stream.samples.size() <= 1 && percent == std::string::npos) return {name};
    // Only %0Nd and %d, once: anything else is not a pattern of ours.
    if (percent == std::string::npos || name.find('%', percent + 1) != std::string::npos) return {};
    std::size_t at = percent + 1;
    int width = 0;
    while (at < name.size() && name[at] >= '0' && name[at] <= '9' && width < 10)
        width = width * 10 + (name[at++] - '0');
    if (at >= name.size() || name[at] != 'd')
        return stream.samples.size() == 1 ? std::vector{name} : std::vector<std::string>();
    std::vector<std::string> names;
    for (std::size_t i = 0; i < stream.samples.size(); ++i)
        names.push_back(
            fmt::format("{}{:0{}}{}", name.substr(0, percent), i, width, name.substr(at + 1)));
    return names;
}

}  // namespace stx::mpeg4
