#include <algorithm>
#include <functional>
#include <limits>
#include <unordered_map>
#include <unordered_set>

#include "formats/files/byte_io.hpp"
#include "formats/mpeg4/bifs/descriptors.hpp"
#include "formats/mpeg4/container/image_headers.hpp"
#include "formats/mpeg4/container/isobmff.hpp"
#include "formats/mpeg4/container/movie_boxes.hpp"
#include "lib/model/same_pictures.hpp"

namespace stx::mpeg4 {
namespace {

using Sink = std::function<Result<void>(ByteSpan)>;

constexpr std::uint64_t kCopyBlock = 1u << 20;
/// Bytes of an image that are looked at for its size; a JPEG may carry much before it.
constexpr std::uint64_t kHeadBytes = 1u << 20;

class Writer {
  public:
    Writer(const Document& document, Job& job, Mp4WriteOptions options)
        : document_(document), job_(job), options_(options) {}

    Result<void> write(const Sink& sink) {
        STX_CHECK(makeTracks());
        return writeTracks(sink, &document_.iod);
    }

    /// One stream without a scene.
    Result<void> writeStream(const ElementaryStream& stream, const Sink& sink) {
        ElementaryStream alone = stream;
        alone.esId = 1;
        STX_TRY(WrittenTrack track, makeMediaTrack(alone, 0));
        tracks_.push_back(std::move(track));
        return writeTracks(sink, nullptr);
    }

  private:
    Result<void> writeTracks(const Sink& sink, const InitialObjectDescriptor* iod) {
        const std::uint64_t payload = placeSamples();
        const std::uint64_t mdatHeader =
            payload + 8 > std::numeric_limits<std::uint32_t>::max() ? 16 : 8;

        ByteWriter head;
        STX_CHECK(writeMovieHead(head, tracks_, iod, false));
        bool wide = head.size() + mdatHeader + payload > std::numeric_limits<std::uint32_t>::max();
        if (wide) {
            head = ByteWriter();
            STX_CHECK(writeMovieHead(head, tracks_, iod, true));
        }
        // The size does not depend on the offsets, so they are known now.
        for (WrittenTrack& track : tracks_) track.offset += head.size() + mdatHeader;
        head = ByteWriter();
        STX_CHECK(writeMovieHead(head, tracks_, iod, wide));

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

    // ---- tracks

    Result<void> makeTracks() {
        STX_CHECK(collectStreams());
        STX_TRY(WrittenTrack scene, makeSceneTrack());
        tracks_.push_back(std::move(scene));
        if (!document_.odFrames.empty()) {
            STX_TRY(WrittenTrack od, makeOdTrack());
            tracks_.push_back(std::move(od));
        }
        for (WrittenTrack& media : media_) tracks_.push_back(std::move(media));
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

    /// Which track each stream of the descriptors becomes. Streams of one ES_ID and the same
    /// samples are one track; with other samples an ES_ID that comes again is another.
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
            if (done) done = collect(stream, odId);
        });
        // Files name the clock's track beside the descriptor, not in it.
        for (WrittenTrack& track : media_) {
            const auto clock =
                track.stream.ocrEsId ? trackOfEs_.find(*track.stream.ocrEsId) : trackOfEs_.end();
            if (clock == trackOfEs_.end()) continue;
            track.clock = clock->second;
            track.stream.ocrEsId.reset();
        }
        return done;
    }

    Result<void> collect(const ElementaryStream& stream, int odId) {
        STX_TRY(std::uint32_t track, earlierTrack(stream));
        if (track == 0) {
            STX_TRY(WrittenTrack made, makeMediaTrack(stream, odId));
            track = made.id;
            media_.push_back(std::move(made));
        }
        trackOfStream_[&stream] = track;
        if (stream.esId == 0) return {};
        trackOfEs_[stream.esId] = track;
        // One without samples says nothing but that it is there.
        if (!stream.samples.empty() || !stream.url.empty()) latestOfEs_[stream.esId] = &stream;
        return {};
    }

    /// The track that a stream has already; 0 for none.
    Result<std::uint32_t> earlierTrack(const ElementaryStream& stream) {
        const auto found = latestOfEs_.find(stream.esId);
        if (found == latestOfEs_.end()) return 0u;
        const ElementaryStream& latest = *found->second;
        const bool same = latest.url == stream.url && latest.timescale == stream.timescale &&
                          latest.samples == stream.samples && latest.edits == stream.edits;
        if (same || (stream.samples.empty() && stream.url.empty()))
            return trackOfStream_.at(&latest);
        STX_TRY(auto key, keyOf(latest));
        trackOfKey_[std::move(key)] = trackOfStream_.at(&latest);
        STX_TRY(const auto own, keyOf(stream));
        const auto known = trackOfKey_.find(own);
        return known == trackOfKey_.end() ? 0u : known->second;
    }
    /// Equal for streams with one ES_ID, url, samples and edits. Reads the samples.
    Result<std::string> keyOf(const ElementaryStream& stream) const {
        std::string key = fmt::format("{} {} {}", stream.esId, stream.url, stream.timescale);
        for (const Sample& sample : stream.samples) {
            STX_TRY(const Bytes bytes, sample.data.load(job_.limits));
            key += fmt::format(" {} {} {}", sample.time, bytes.size(), hashOf(bytes));
        }
        for (const Edit& edit : stream.edits.edits)
            key += fmt::format(" {} {} {} {}", edit.duration, edit.mediaTime, edit.rate,
                               stream.edits.timescale);
        return key;
    }

    Result<WrittenTrack> makeMediaTrack(const ElementaryStream& stream, int odId) {
        const std::string what = fmt::format("the stream of object descriptor {}", odId);
        WrittenTrack track;
        const bool clashes =
            stream.esId == sceneId_ || stream.esId == odId_ || trackOfEs_.contains(stream.esId);
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
        const bool ownEntry = !out.sampleEntry.empty();
        if (out.objectTypeIndication == 0 && !ownEntry)
            return fail(ErrorCode::invalidInput,
                        "{} is neither JPEG nor PNG and has no objectTypeIndication", what);
        if (out.streamType == StreamType::none && !ownEntry) out.streamType = StreamType::visual;
        const bool visual = out.streamType == StreamType::visual;
        if (!visual) out.width = out.height = 0;
        if (out.width < 0 || out.width > 65535 || out.height < 0 || out.height > 65535)
            return fail(ErrorCode::invalidInput, "{} is {}x{} pixels; 65535x65535 are possible",
                        what, out.width, out.height);
        track.handler = visual ? "vide" : out.streamType == StreamType::audio ? "soun" : "gesm";
        if (ownEntry && out.handler.size() == 4) track.handler = out.handler;
        track.handlerName = visual ? "MPEG-4 image" : "MPEG-4 stream";
        if (!stream.trackName.empty()) track.handlerName = stream.trackName;
        STX_CHECK(finish(track, what));
        return track;
    }

    /// Sizes, rates and duration of a track whose samples are known.
    static Result<void> finish(WrittenTrack& track, const std::string& what) {
        ElementaryStream& stream = track.stream;
        if (stream.timescale == 0) return fail(ErrorCode::invalidInput, "{} has timescale 0", what);
        std::uint64_t largest = 0;
        if (!stream.samples.empty()) track.start = stream.samples.front().time;
        std::uint64_t time = track.start;
        for (const Sample& sample : stream.samples) {
            if (sample.data.size > std::numeric_limits<std::uint32_t>::max())
                return fail(ErrorCode::invalidInput,
                            "{} has a sample of {} bytes; 4 GiB less one byte are possible", what,
                            sample.data.size);
            if (sample.time < time)
                return fail(ErrorCode::invalidInput,
                            "{} has an access unit at time {} behind one at {}; time may not go "
                            "back",
                            what, sample.time, time);
            if (sample.time - time > std::numeric_limits<std::uint32_t>::max())
                return fail(ErrorCode::invalidInput, "{} has a gap of {} ticks", what,
                            sample.time - time);
            time = sample.time;
            largest = std::max(largest, sample.data.size);
            track.bytes += sample.data.size;
        }
        if (!stream.samples.empty())
            track.duration = time - track.start + stream.samples.back().duration;
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

    /// One that holds a command that is not known here is as it was, if ids are as wide as then.
    static Result<Bytes> encode(BifsEncoder& encoder, const CommandFrame& frame,
                                const BifsConfig& config) {
        if (!frame.coded) return encoder.encode(frame.commands);
        // For what later ones may name.
        if (!frame.commands.empty()) STX_CHECK(encoder.encode(frame.commands));
        const CommandCoding was = frame.coded->coding.value_or(CommandCoding());
        if (codingOf(config, was.useNames) != was)
            return fail(ErrorCode::unsupported,
                        "the access unit has a command that is not known here, with ids of {} and "
                        "{} bits for nodes and ROUTEs, but the scene is written with {} and {}; "
                        "remove it from the presentation",
                        was.nodeIdBits, was.routeIdBits, config.nodeIdBits, config.routeIdBits);
        const auto bytes = std::as_bytes(std::span(frame.coded->bytes));
        return Bytes(bytes.begin(), bytes.end());
    }

    Result<WrittenTrack> makeSceneTrack() {
        const NodeIds ids = assignNodeIds(document_.frames);
        const BifsConfig config = fitBifsConfig(document_.bifsConfig, ids);
        if (document_.frames.empty())
            return fail(ErrorCode::invalidInput, "the document has no scene");
        WrittenTrack track;
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
            STX_TRY(auto bytes, within(fmt::format("BIFS access unit {}", i + 1),
                                       encode(encoder, document_.frames[i], config)));
            addFrame(track, std::move(bytes), document_.frames[i]);
        }
        if (encoder.mostRounded() > 0)
            job_.note(fmt::format(
                "a QuantizationParameter rounds values of the scene: at most {:.4g} off",
                encoder.mostRounded()));
        STX_CHECK(finish(track, "the scene"));
        return track;
    }

    Result<WrittenTrack> makeOdTrack() {
        WrittenTrack track;
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
        for (const WrittenTrack& media : media_) {
            track.mpod.push_back(media.id);
            places[media.id] = static_cast<std::uint32_t>(track.mpod.size());
        }
        const auto referenceOf = [&](std::uint32_t trackId) {
            const auto found = places.find(trackId);
            return found == places.end() ? 0 : found->second;
        };
        for (std::size_t i = 0; i < document_.odFrames.size(); ++i) {
            STX_TRY(auto bytes, within(fmt::format("OD access unit {}", i + 1),
                                       encodeOdFrame(withTrackIds(document_.odFrames[i].commands),
                                                     referenceOf)));
            addFrame(track, std::move(bytes), document_.odFrames[i]);
        }
        STX_CHECK(finish(track, "the object descriptor stream"));
        return track;
    }

    /// The commands with their streams reduced to the tracks they became.
    std::vector<OdCommand> withTrackIds(const std::vector<OdCommand>& commands) {
        const auto reduce = [&](const std::vector<ElementaryStream>& streams) {
            std::vector<ElementaryStream> reduced;
            for (const ElementaryStream& stream : streams) {
                reduced.emplace_back().esId = trackOfStream_.at(&stream);
                // What a later removal means by the ES_ID.
                if (stream.esId != 0) trackOfEs_[stream.esId] = reduced.back().esId;
            }
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

    template <class Frame>
    static void addFrame(WrittenTrack& track, Bytes bytes, const Frame& frame) {
        Sample sample;
        sample.data = ByteRange::of(std::move(bytes));
        sample.time = frame.time;
        sample.sync = track.stream.samples.empty() || frame.randomAccess;
        sample.duration = 0;
        track.stream.samples.push_back(std::move(sample));
    }

    // ---- samples

    /// Gives each track its place in mdat; returns the bytes of all.
    std::uint64_t placeSamples() {
        std::uint64_t at = 0;
        for (WrittenTrack& track : tracks_) {
            track.offset = at;
            at += track.bytes;
        }
        return at;
    }

    Result<void> writeSamples(const Sink& sink) {
        Bytes block;
        for (const WrittenTrack& track : tracks_)
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

    const Document& document_;
    Job& job_;
    Mp4WriteOptions options_;
    std::vector<WrittenTrack> tracks_;
    std::vector<WrittenTrack> media_;
    std::unordered_set<std::uint32_t> takenIds_;
    std::uint32_t nextFree_ = 1;
    std::uint32_t sceneId_ = 0;
    std::uint32_t odId_ = 0;
    std::unordered_map<const ElementaryStream*, std::uint32_t> trackOfStream_;
    std::unordered_map<std::uint32_t, std::uint32_t> trackOfEs_;
    std::unordered_map<std::uint32_t, const ElementaryStream*> latestOfEs_;  ///< of each ES_ID
    std::unordered_map<std::string, std::uint32_t> trackOfKey_;  ///< of those that were replaced
};

}  // namespace

Result<void> writeMp4(const Document& document, OutputFile& out, Job& job,
                      const Mp4WriteOptions& options) {
    return Writer(document, job, options).write([&](ByteSpan bytes) { return out.write(bytes); });
}

Result<void> writeMp4Stream(const ElementaryStream& stream, OutputFile& out, Job& job) {
    const Document none;
    return Writer(none, job, {}).writeStream(stream, [&](ByteSpan bytes) {
        return out.write(bytes);
    });
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
