#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <functional>
#include <limits>
#include <unordered_map>
#include <unordered_set>

#include "formats/mpeg4/byte_io.hpp"
#include "formats/mpeg4/descriptors.hpp"
#include "formats/mpeg4/image_headers.hpp"
#include "formats/mpeg4/isobmff.hpp"

namespace stx::mpeg4 {
namespace {

using Sink = std::function<Result<void>(ByteSpan)>;

constexpr std::uint32_t kMovieTimescale = 600;
constexpr std::uint64_t kCopyBlock = 1u << 20;
/// Bytes of an image that are looked at for its size; a JPEG may carry much before it.
constexpr std::uint64_t kHeadBytes = 1u << 20;

/// Seconds from 1904 to 1970.
constexpr std::uint64_t kEpochOffset = 2082844800;

/// What SOURCE_DATE_EPOCH says, in the file's epoch; 0 without it, so that files are the same
/// bytes.
std::uint64_t creationTime() {
    const char* text = std::getenv("SOURCE_DATE_EPOCH");
    if (text == nullptr) return 0;
    std::uint64_t seconds = 0;
    const std::string_view view(text);
    const auto parsed = std::from_chars(view.data(), view.data() + view.size(), seconds);
    if (parsed.ec != std::errc{} ||
        seconds > std::numeric_limits<std::uint32_t>::max() - kEpochOffset)
        return 0;
    return seconds + kEpochOffset;
}

/// A box being written: the size is put in when it ends.
class BoxScope {
  public:
    BoxScope(ByteWriter& out, std::string_view type) : out_(out), start_(out.size()) {
        out.u32(0);
        out.text(type);
    }
    /// A full box.
    BoxScope(ByteWriter& out, std::string_view type, std::uint8_t version, std::uint32_t flags)
        : BoxScope(out, type) {
        out.u8(version);
        out.u24(flags);
    }
    BoxScope(const BoxScope&) = delete;
    BoxScope& operator=(const BoxScope&) = delete;
    ~BoxScope() { out_.patch32(start_, static_cast<std::uint32_t>(out_.size() - start_)); }

  private:
    ByteWriter& out_;
    std::size_t start_;
};

/// A track to write: its descriptor, its samples, what it is called.
struct Track {
    std::uint32_t id = 0;
    ElementaryStream stream;
    std::string_view handler;
    std::string_view handlerName;
    std::vector<std::uint32_t> mpod;
    std::uint64_t bytes = 0;
    std::uint64_t duration = 0;  ///< in the stream's timescale
    std::uint64_t offset = 0;    ///< of the only chunk
};

bool isSystems(const Track& track) {
    return track.stream.streamType != StreamType::visual;
}

std::uint64_t movieDuration(const Track& track) {
    const std::uint64_t whole = track.duration / track.stream.timescale * kMovieTimescale;
    return whole +
           track.duration % track.stream.timescale * kMovieTimescale / track.stream.timescale;
}

class Writer {
  public:
    Writer(const Document& document, Job& job, const Mp4WriteOptions& options)
        : document_(document), job_(job), options_(options) {}

    Result<void> write(const Sink& sink) {
        STX_CHECK(makeTracks());
        const std::uint64_t payload = placeSamples();
        const std::uint64_t mdatHeader =
            payload + 8 > std::numeric_limits<std::uint32_t>::max() ? 16 : 8;

        ByteWriter head;
        STX_CHECK(writeHead(head, false));
        bool wide = head.size() + mdatHeader + payload > std::numeric_limits<std::uint32_t>::max();
        if (wide) {
            head = ByteWriter();
            STX_CHECK(writeHead(head, true));
        }
        // The size does not depend on the offsets, so they are known now.
        for (Track& track : tracks_) track.offset += head.size() + mdatHeader;
        head = ByteWriter();
        STX_CHECK(writeHead(head, wide));

        if (mdatHeader == 16) {
            head.u32(1);
            head.text("mdat");
            head.u64(payload + 16);
        } else {
            head.u32(static_cast<std::uint32_t>(payload + 8));
            head.text("mdat");
        }
        STX_CHECK(sink(head.view()));
        return writeSamples(sink);
    }

  private:
    // ---- tracks

    Result<void> makeTracks() {
        STX_CHECK(collectStreams());
        STX_TRY(Track scene, makeSceneTrack());
        tracks_.push_back(std::move(scene));
        if (!document_.odFrames.empty()) {
            STX_TRY(Track od, makeOdTrack());
            tracks_.push_back(std::move(od));
        }
        for (Track& media : media_) tracks_.push_back(std::move(media));
        return {};
    }

    /// A track id that no stream asked for.
    std::uint32_t freeId() {
        while (takenIds_.contains(nextFree_)) ++nextFree_;
        takenIds_.insert(nextFree_);
        return nextFree_;
    }

    template <class Visit>
    void eachStream(const Visit& visit) const {
        for (const OdFrame& frame : document_.odFrames)
            for (const OdCommand& command : frame.commands) {
                if (const auto* update = std::get_if<UpdateObjectDescriptors>(&command))
                    for (const ObjectDescriptor& od : update->descriptors)
                        for (const ElementaryStream& stream : od.streams) visit(stream, od.id);
                if (const auto* update = std::get_if<UpdateStreams>(&command))
                    for (const ElementaryStream& stream : update->streams)
                        visit(stream, update->objectDescriptorId);
            }
    }

    /// Which track each stream of the descriptors becomes. Streams of one ES_ID are one track.
    Result<void> collectStreams() {
        for (const std::uint32_t id : {document_.sceneStream.esId, document_.odStream.esId})
            if (id != 0) takenIds_.insert(id);
        eachStream([&](const ElementaryStream& stream, int) {
            if (stream.esId != 0) takenIds_.insert(stream.esId);
        });
        sceneId_ = document_.sceneStream.esId != 0 ? document_.sceneStream.esId : freeId();
        odId_ = document_.odStream.esId != 0 && document_.odStream.esId != sceneId_
                    ? document_.odStream.esId
                    : freeId();

        Result<void> done;
        eachStream([&](const ElementaryStream& stream, int odId) {
            if (!done) return;
            const bool shared = stream.esId != 0 && trackOfEs_.contains(stream.esId);
            if (shared) {
                trackOfStream_[&stream] = trackOfEs_.at(stream.esId);
                return;
            }
            auto track = makeMediaTrack(stream, odId);
            if (!track) {
                done = tl::unexpected(track.error());
                return;
            }
            trackOfStream_[&stream] = track->id;
            if (stream.esId != 0) trackOfEs_[stream.esId] = track->id;
            media_.push_back(std::move(*track));
        });
        return done;
    }

    Result<Track> makeMediaTrack(const ElementaryStream& stream, int odId) {
        const std::string what = fmt::format("the stream of object descriptor {}", odId);
        Track track;
        const bool clashes = stream.esId == sceneId_ || stream.esId == odId_;
        track.id = stream.esId == 0 || clashes ? freeId() : stream.esId;
        track.stream = stream;
        ElementaryStream& out = track.stream;
        if (out.samples.empty() && out.url.empty())
            return fail(ErrorCode::invalidInput, "{} has no data ('{}' was not read)", what,
                        stream.fileName);

        if (!out.samples.empty()) {
            const ByteRange& first = out.samples.front().data;
            ByteRange headRange = first;
            headRange.size = std::min(first.size, kHeadBytes);
            STX_TRY(const Bytes head, headRange.load(job_.limits));
            if (const auto image = readImageHeader(head)) {
                if (out.objectTypeIndication == 0)
                    out.objectTypeIndication = image->objectTypeIndication;
                if (out.streamType == StreamType::none) out.streamType = StreamType::visual;
                if (out.width == 0 || out.height == 0) {
                    out.width = image->width;
                    out.height = image->height;
                }
                if (out.objectTypeIndication == oti::kJpeg &&
                    image->objectTypeIndication == oti::kJpeg && out.decoderSpecificInfo.empty())
                    out.decoderSpecificInfo = jpegDecoderSpecificInfo(*image);
            }
        }
        if (out.objectTypeIndication == 0)
            return fail(ErrorCode::invalidInput,
                        "{} is neither JPEG nor PNG and has no objectTypeIndication", what);
        if (out.streamType == StreamType::none) out.streamType = StreamType::visual;
        if (out.width < 0 || out.width > 65535 || out.height < 0 || out.height > 65535)
            return fail(ErrorCode::invalidInput, "{} is {}x{} pixels; 65535x65535 are possible",
                        what, out.width, out.height);
        const bool visual = out.streamType == StreamType::visual;
        if (!visual) out.width = out.height = 0;
        track.handler = visual ? "vide" : out.streamType == StreamType::audio ? "soun" : "gesm";
        track.handlerName = visual ? "MPEG-4 image" : "MPEG-4 stream";
        STX_CHECK(finish(track, what));
        return track;
    }

    /// Sizes, rates and duration of a track whose samples are known.
    static Result<void> finish(Track& track, const std::string& what) {
        ElementaryStream& stream = track.stream;
        if (stream.timescale == 0) return fail(ErrorCode::invalidInput, "{} has timescale 0", what);
        std::uint64_t largest = 0;
        std::uint64_t time = 0;
        for (const Sample& sample : stream.samples) {
            if (sample.data.size > std::numeric_limits<std::uint32_t>::max())
                return fail(ErrorCode::invalidInput,
                            "{} has a sample of {} bytes; 4 GiB less one byte are possible", what,
                            sample.data.size);
            if (&sample == &stream.samples.front() ? sample.time != 0 : sample.time < time)
                return fail(ErrorCode::invalidInput,
                            "{} has an access unit at time {}, but the first must be at 0 and time "
                            "may not go back",
                            what, sample.time);
            if (sample.time - time > std::numeric_limits<std::uint32_t>::max())
                return fail(ErrorCode::invalidInput, "{} has a gap of {} ticks", what,
                            sample.time - time);
            time = sample.time;
            largest = std::max(largest, sample.data.size);
            track.bytes += sample.data.size;
        }
        if (!stream.samples.empty()) track.duration = time + stream.samples.back().duration;
        if (stream.bufferSizeDB == 0)
            stream.bufferSizeDB =
                static_cast<std::uint32_t>(std::min<std::uint64_t>(largest, 0xFFFFFF));
        if (stream.streamType == StreamType::visual && track.duration > 0 &&
            stream.avgBitrate == 0) {
            const double rate = static_cast<double>(track.bytes) * 8 * stream.timescale /
                                static_cast<double>(track.duration);
            stream.avgBitrate = static_cast<std::uint32_t>(std::min(rate, 4294967295.0));
        }
        if (stream.maxBitrate == 0) stream.maxBitrate = stream.avgBitrate;
        return {};
    }

    Result<Track> makeSceneTrack() {
        const NodeIds ids = assignNodeIds(document_.frames);
        const BifsConfig config = fitBifsConfig(document_.bifsConfig, ids);
        if (document_.frames.empty())
            return fail(ErrorCode::invalidInput, "the document has no scene");
        Track track;
        track.id = sceneId_;
        track.stream = document_.sceneStream;
        track.stream.samples.clear();
        track.stream.streamType = StreamType::sceneDescription;
        track.stream.objectTypeIndication = config.version == 2 ? oti::kSystemsV2 : oti::kSystemsV1;
        track.stream.decoderSpecificInfo = encodeBifsConfig(config);
        track.stream.bufferSizeDB = 0;
        track.stream.width = config.hasSize ? config.pixelWidth : 0;
        track.stream.height = config.hasSize ? config.pixelHeight : 0;
        track.handler = "sdsm";
        track.handlerName = "MPEG-4 scene description";
        BifsEncoder encoder(config, options_.style, ids);
        for (std::size_t i = 0; i < document_.frames.size(); ++i) {
            auto bytes = encoder.encode(document_.frames[i].commands);
            if (!bytes)
                return tl::unexpected(bytes.error().at(fmt::format("BIFS access unit {}", i + 1)));
            addFrame(track, std::move(*bytes), document_.frames[i].time);
        }
        STX_CHECK(finish(track, "the scene"));
        return track;
    }

    Result<Track> makeOdTrack() {
        Track track;
        track.id = odId_;
        track.stream = document_.odStream;
        track.stream.samples.clear();
        track.stream.streamType = StreamType::objectDescriptor;
        track.stream.objectTypeIndication = oti::kSystemsV1;
        track.stream.decoderSpecificInfo.clear();
        track.stream.bufferSizeDB = 0;
        track.stream.width = track.stream.height = 0;
        track.handler = "odsm";
        track.handlerName = "MPEG-4 object descriptors";
        std::unordered_map<std::uint32_t, std::uint32_t> places;
        for (const Track& media : media_) {
            track.mpod.push_back(media.id);
            places[media.id] = static_cast<std::uint32_t>(track.mpod.size());
        }
        const auto referenceOf = [&](std::uint32_t trackId) {
            const auto found = places.find(trackId);
            return found == places.end() ? 0 : found->second;
        };
        for (std::size_t i = 0; i < document_.odFrames.size(); ++i) {
            auto bytes = encodeOdFrame(withTrackIds(document_.odFrames[i].commands), referenceOf);
            if (!bytes)
                return tl::unexpected(bytes.error().at(fmt::format("OD access unit {}", i + 1)));
            addFrame(track, std::move(*bytes), document_.odFrames[i].time);
        }
        STX_CHECK(finish(track, "the object descriptor stream"));
        return track;
    }

    /// The commands with their streams reduced to the tracks they became.
    std::vector<OdCommand> withTrackIds(const std::vector<OdCommand>& commands) const {
        const auto reduce = [&](const std::vector<ElementaryStream>& streams) {
            std::vector<ElementaryStream> reduced;
            for (const ElementaryStream& stream : streams)
                reduced.emplace_back().esId = trackOfStream_.at(&stream);
            return reduced;
        };
        std::vector<OdCommand> result;
        for (const OdCommand& command : commands) {
            if (const auto* update = std::get_if<UpdateObjectDescriptors>(&command)) {
                UpdateObjectDescriptors reduced;
                for (const ObjectDescriptor& od : update->descriptors)
                    reduced.descriptors.push_back({od.id, od.url, reduce(od.streams)});
                result.push_back(std::move(reduced));
            } else if (const auto* streams = std::get_if<UpdateStreams>(&command)) {
                result.push_back(
                    UpdateStreams{streams->objectDescriptorId, reduce(streams->streams)});
            } else if (const auto* removal = std::get_if<RemoveStreams>(&command)) {
                RemoveStreams reduced{removal->objectDescriptorId, {}};
                for (const std::uint32_t esId : removal->esIds) {
                    const auto found = trackOfEs_.find(esId);
                    reduced.esIds.push_back(found == trackOfEs_.end() ? esId : found->second);
                }
                result.push_back(std::move(reduced));
            } else {
                result.push_back(command);
            }
        }
        return result;
    }

    static void addFrame(Track& track, Bytes bytes, std::uint64_t time) {
        Sample sample;
        sample.data = ByteRange::of(std::move(bytes));
        sample.time = time;
        sample.duration = 0;
        track.stream.samples.push_back(std::move(sample));
    }

    // ---- samples

    /// Gives each track its place in mdat; returns the bytes of all.
    std::uint64_t placeSamples() {
        std::uint64_t at = 0;
        for (Track& track : tracks_) {
            track.offset = at;
            at += track.bytes;
        }
        return at;
    }

    Result<void> writeSamples(const Sink& sink) {
        Bytes block;
        for (const Track& track : tracks_)
            for (const Sample& sample : track.stream.samples) {
                STX_CHECK(job_.checkCancelled());
                const ByteRange& range = sample.data;
                if (const ByteSpan view = range.source.view();
                    range.offset <= view.size() && range.size <= view.size() - range.offset &&
                    !view.empty()) {
                    STX_CHECK(sink(view.subspan(static_cast<std::size_t>(range.offset),
                                                static_cast<std::size_t>(range.size))));
                    continue;
                }
                for (std::uint64_t done = 0; done < range.size;) {
                    block.resize(static_cast<std::size_t>(std::min(kCopyBlock, range.size - done)));
                    STX_CHECK(range.source.read(range.offset + done, block));
                    STX_CHECK(sink(block));
                    done += block.size();
                }
            }
        return {};
    }

    // ---- boxes

    Result<void> writeHead(ByteWriter& out, bool wide) {
        {
            const BoxScope ftyp(out, "ftyp");
            out.text("mp42");
            out.u32(1);
            out.text("isommp42mp41");
        }
        const BoxScope moov(out, "moov");
        std::uint64_t duration = 0;
        std::uint32_t highest = 0;
        for (const Track& track : tracks_) {
            duration = std::max(duration, movieDuration(track));
            highest = std::max(highest, track.id);
        }
        writeMovieHeader(out, duration, highest);
        {
            const BoxScope iods(out, "iods", 0, 0);
            std::vector<std::uint32_t> initial;
            for (const Track& track : tracks_)
                if (track.handler == "sdsm" || track.handler == "odsm") initial.push_back(track.id);
            STX_TRY(const Bytes descriptor, encodeIod(document_.iod, initial));
            out.bytes(descriptor);
        }
        for (const Track& track : tracks_) STX_CHECK(writeTrack(out, track, wide));
        return {};
    }

    /// Version 1 boxes carry times of 64 bits; version 0 is used where it suffices.
    static void writeTimes(ByteWriter& out, bool wide, std::uint32_t between, bool reserved,
                           std::uint64_t duration) {
        const std::uint64_t created = creationTime();
        const auto time = [&](std::uint64_t value) {
            if (wide)
                out.u64(value);
            else
                out.u32(static_cast<std::uint32_t>(value));
        };
        time(created);
        time(created);
        out.u32(between);
        if (reserved) out.u32(0);
        time(duration);
    }
    static bool needsWide(std::uint64_t duration) {
        return duration > std::numeric_limits<std::uint32_t>::max();
    }

    static void writeMatrix(ByteWriter& out) {
        for (const std::uint32_t value : {0x10000u, 0u, 0u, 0u, 0x10000u, 0u, 0u, 0u, 0x40000000u})
            out.u32(value);
    }

    static void writeMovieHeader(ByteWriter& out, std::uint64_t duration, std::uint32_t highestId) {
        const bool wide = needsWide(duration);
        const BoxScope mvhd(out, "mvhd", wide ? 1 : 0, 0);
        writeTimes(out, wide, kMovieTimescale, false, duration);
        out.u32(0x10000);
        out.u16(0x0100);
        out.zeros(10);
        writeMatrix(out);
        out.zeros(24);
        out.u32(highestId == std::numeric_limits<std::uint32_t>::max() ? highestId : highestId + 1);
    }

    Result<void> writeTrack(ByteWriter& out, const Track& track, bool wide) {
        const BoxScope trak(out, "trak");
        {
            const std::uint64_t duration = movieDuration(track);
            const BoxScope tkhd(out, "tkhd", needsWide(duration) ? 1 : 0, isSystems(track) ? 1 : 7);
            writeTimes(out, needsWide(duration), track.id, true, duration);
            out.zeros(16);
            writeMatrix(out);
            out.u32(static_cast<std::uint32_t>(track.stream.width) << 16);
            out.u32(static_cast<std::uint32_t>(track.stream.height) << 16);
        }
        if (!track.mpod.empty()) {
            const BoxScope tref(out, "tref");
            const BoxScope mpod(out, "mpod");
            for (const std::uint32_t id : track.mpod) out.u32(id);
        }
        const BoxScope mdia(out, "mdia");
        {
            const BoxScope mdhd(out, "mdhd", needsWide(track.duration) ? 1 : 0, 0);
            writeTimes(out, needsWide(track.duration), track.stream.timescale, false,
                       track.duration);
            out.u16(0x55C4);  // language 'und'
            out.u16(0);
        }
        {
            const BoxScope hdlr(out, "hdlr", 0, 0);
            out.u32(0);
            out.text(track.handler);
            out.zeros(12);
            out.text(track.handlerName);
            out.u8(0);
        }
        const BoxScope minf(out, "minf");
        if (!isSystems(track)) {
            const BoxScope vmhd(out, "vmhd", 0, 1);
            out.zeros(8);
        } else if (track.handler == "soun") {
            const BoxScope smhd(out, "smhd", 0, 0);
            out.zeros(4);
        } else {
            const BoxScope nmhd(out, "nmhd", 0, 0);
        }
        {
            const BoxScope dinf(out, "dinf");
            const BoxScope dref(out, "dref", 0, 0);
            out.u32(1);
            const BoxScope url(out, "url ", 0, 1);
        }
        const BoxScope stbl(out, "stbl");
        STX_CHECK(writeSampleEntry(out, track));
        writeTables(out, track, wide);
        return {};
    }

    static Result<void> writeSampleEntry(ByteWriter& out, const Track& track) {
        STX_TRY(const Bytes descriptor, encodeEsDescriptor(track.stream));
        const BoxScope stsd(out, "stsd", 0, 0);
        out.u32(1);
        const bool visual = !isSystems(track);
        const BoxScope entry(out, visual ? "mp4v" : track.handler == "soun" ? "mp4a" : "mp4s");
        out.zeros(6);
        out.u16(1);
        if (visual) {
            out.zeros(16);
            out.u16(static_cast<std::uint16_t>(track.stream.width));
            out.u16(static_cast<std::uint16_t>(track.stream.height));
            out.u32(0x480000);
            out.u32(0x480000);
            out.u32(0);
            out.u16(1);
            out.zeros(32);
            out.u16(0x18);
            out.u16(0xFFFF);
        } else if (track.handler == "soun") {
            out.zeros(8);
            out.u16(2);
            out.u16(16);
            out.zeros(4);
            out.u32(track.stream.timescale << 16);
        }
        const BoxScope esds(out, "esds", 0, 0);
        out.bytes(descriptor);
        return {};
    }

    static void writeRuns(ByteWriter& out, const std::vector<std::uint32_t>& values) {
        std::vector<std::pair<std::uint32_t, std::uint32_t>> runs;
        for (const std::uint32_t value : values) {
            if (!runs.empty() && runs.back().second == value)
                ++runs.back().first;
            else
                runs.emplace_back(1, value);
        }
        out.u32(static_cast<std::uint32_t>(runs.size()));
        for (const auto& [count, value] : runs) {
            out.u32(count);
            out.u32(value);
        }
    }

    static void writeTables(ByteWriter& out, const Track& track, bool wide) {
        const std::vector<Sample>& samples = track.stream.samples;
        const auto count = static_cast<std::uint32_t>(samples.size());
        std::vector<std::uint32_t> deltas;
        std::vector<std::uint32_t> offsets;
        std::vector<std::uint32_t> syncs;
        for (std::size_t i = 0; i < samples.size(); ++i) {
            deltas.push_back(i + 1 < samples.size()
                                 ? static_cast<std::uint32_t>(samples[i + 1].time - samples[i].time)
                                 : samples[i].duration);
            offsets.push_back(static_cast<std::uint32_t>(samples[i].compositionOffset));
            if (samples[i].sync) syncs.push_back(static_cast<std::uint32_t>(i + 1));
        }
        {
            const BoxScope stts(out, "stts", 0, 0);
            writeRuns(out, deltas);
        }
        if (std::any_of(offsets.begin(), offsets.end(), [](std::uint32_t o) { return o != 0; })) {
            const bool negative = std::any_of(offsets.begin(), offsets.end(),
                                              [](std::uint32_t o) { return o >> 31 != 0; });
            const BoxScope ctts(out, "ctts", negative ? 1 : 0, 0);
            writeRuns(out, offsets);
        }
        if (syncs.size() != samples.size()) {
            const BoxScope stss(out, "stss", 0, 0);
            out.u32(static_cast<std::uint32_t>(syncs.size()));
            for (const std::uint32_t number : syncs) out.u32(number);
        }
        {
            const BoxScope stsc(out, "stsc", 0, 0);
            out.u32(count > 0 ? 1 : 0);
            if (count > 0) {
                out.u32(1);
                out.u32(count);
                out.u32(1);
            }
        }
        {
            const bool same = std::all_of(samples.begin(), samples.end(), [&](const Sample& s) {
                return s.data.size == samples.front().data.size;
            });
            const bool common = count > 0 && same && samples.front().data.size > 0;
            const BoxScope stsz(out, "stsz", 0, 0);
            out.u32(common ? static_cast<std::uint32_t>(samples.front().data.size) : 0);
            out.u32(count);
            if (!common)
                for (const Sample& sample : samples)
                    out.u32(static_cast<std::uint32_t>(sample.data.size));
        }
        const BoxScope stco(out, wide ? "co64" : "stco", 0, 0);
        out.u32(count > 0 ? 1 : 0);
        if (count == 0) return;
        if (wide)
            out.u64(track.offset);
        else
            out.u32(static_cast<std::uint32_t>(track.offset));
    }

    const Document& document_;
    Job& job_;
    const Mp4WriteOptions& options_;
    std::vector<Track> tracks_;
    std::vector<Track> media_;
    std::unordered_set<std::uint32_t> takenIds_;
    std::uint32_t nextFree_ = 1;
    std::uint32_t sceneId_ = 0;
    std::uint32_t odId_ = 0;
    std::unordered_map<const ElementaryStream*, std::uint32_t> trackOfStream_;
    std::unordered_map<std::uint32_t, std::uint32_t> trackOfEs_;
};

}  // namespace

Result<void> writeMp4(const Document& document, OutputFile& out, Job& job,
                      const Mp4WriteOptions& options) {
    return Writer(document, job, options).write([&](ByteSpan bytes) { return out.write(bytes); });
}

Result<Bytes> writeMp4(const Document& document, Job& job, const Mp4WriteOptions& options) {
    Bytes all;
    auto done = Writer(document, job, options).write([&](ByteSpan bytes) -> Result<void> {
        STX_CHECK(job.limits.checkAllocation(all.size() + bytes.size(), 1, "the MP4 file"));
        all.insert(all.end(), bytes.begin(), bytes.end());
        return {};
    });
    if (!done) return propagate(done);
    return all;
}

}  // namespace stx::mpeg4
