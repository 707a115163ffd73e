#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <unordered_map>

#include "formats/mpeg4/bifs/descriptors.hpp"
#include "formats/mpeg4/container/isobmff.hpp"
#include "formats/mpeg4/container/isobmff_track.hpp"
#include "lib/base/printable.hpp"

namespace stx::mpeg4 {
namespace {

using Deviation = Mp4Deviation::Kind;

/// Top-level boxes of a file; more are a way to keep us reading, not a file.
constexpr int kMaxTopLevelBoxes = 1'000'000;

class Reader {
  public:
    Reader(const ByteSource& source, Job& job) : source_(source), job_(job) {
        document_.mp4.emplace();
    }

    Result<Document> read() {
        STX_CHECK(readTopLevel());
        STX_CHECK(readMoov());
        STX_CHECK(pickStreams());
        STX_CHECK(readObjectDescriptors());
        STX_CHECK(readScene());
        for (Mp4Track& track : tracks_) {
            if (!samples_.contains(track.facts.trackId)) sumSamples(track);
            if (&track != scene_ && &track != od_ && !track.facts.referenced)
                job_.note(
                    fmt::format("track {} ('{}') is passed over: no object descriptor names it",
                                track.facts.trackId, printable(track.facts.handler)));
            facts().tracks.push_back(track.facts);
        }
        return std::move(document_);
    }

    Result<ElementaryStream> readStream(const TrackChoice& choice) {
        STX_CHECK(readTopLevel());
        STX_CHECK(readMoov());
        Mp4Track* track = findTrack(choice.id);
        for (Mp4Track& one : tracks_)
            if (track == nullptr && !choice.handler.empty() && one.facts.handler == choice.handler)
                track = &one;
        if (track == nullptr)
            return failAt("moov", ErrorCode::invalidInput,
                          "the file has no track {}; its tracks are {}",
                          choice.handler.empty() ? fmt::format("{}", choice.id)
                                                 : fmt::format("of kind '{}'", choice.handler),
                          trackNumbers());
        if (track->elsewhere)
            return failAt(track->path, ErrorCode::unsupported,
                          "the data of the track are in another file, which is not opened");
        STX_TRY(const std::vector<Sample>* samples, samplesOf(*track));
        ElementaryStream stream = track->stream;
        stream.samples = *samples;
        return stream;
    }

  private:
    std::string trackNumbers() const {
        std::vector<std::uint32_t> numbers;
        for (const Mp4Track& track : tracks_)
            if (numbers.size() < 20) numbers.push_back(track.facts.trackId);
        return numbers.empty() ? "none" : fmt::format("{}", fmt::join(numbers, ", "));
    }
    Mp4Facts& facts() { return *document_.mp4; }
    void addDeviation(Deviation kind, std::string text, std::string where) {
        if (facts().deviations.size() < kMaxDeviations)
            facts().deviations.push_back({kind, std::move(text), std::move(where)});
    }

    // ---- boxes

    Result<void> readTopLevel() {
        const std::uint64_t size = source_.size();
        facts().fileSize = size;
        std::uint64_t at = 0;
        bool mediaSeen = false;
        for (int number = 0; at < size; ++number) {
            const auto place = [&] { return fmt::format("byte {}", at); };
            if (number == kMaxTopLevelBoxes)
                return failAt(place(), ErrorCode::invalidInput, "the file has more than {} boxes",
                              kMaxTopLevelBoxes);
            if (size - at < 8)
                return failAt(place(), ErrorCode::invalidInput,
                              "{} bytes are left, too few for a box", size - at);
            std::array<std::byte, 16> head{};
            const auto headSize = static_cast<std::size_t>(std::min<std::uint64_t>(16, size - at));
            STX_CHECK(source_.read(at, std::span<std::byte>(head).first(headSize)));
            ByteReader in(ByteSpan(head).first(headSize), at);
            std::uint64_t boxSize = in.u32();
            const std::string type = in.text(4);
            std::uint64_t header = 8;
            if (boxSize == 1) {
                boxSize = in.u64();
                header = 16;
            } else if (boxSize == 0) {
                boxSize = size - at;
            }
            if (number == 0 && type != "ftyp" && type != "moov" && type != "mdat" &&
                type != "free" && type != "skip" && type != "wide" && type != "pdin")
                return failAt(place(), ErrorCode::invalidInput,
                              "this is not an MP4 file: it starts with a box '{}'",
                              printable(type));
            if (in.failed() || boxSize < header || boxSize > size - at)
                return failAt(place(), ErrorCode::invalidInput,
                              "the box '{}' claims {} bytes; {} are left in the file",
                              printable(type), boxSize, size - at);
            if (type == "moof" || type == "sidx")
                return failAt(fmt::format("{} at byte {}", type, at), ErrorCode::unsupported,
                              "the file is fragmented; rewrite it as one with a single 'moov'");
            if (type == "mdat") mediaSeen = true;
            if (type == "ftyp" || type == "moov")
                STX_CHECK(keep(type, at + header, boxSize - header, mediaSeen));
            at += boxSize;
        }
        if (moov_.type.empty())
            return failAt(fmt::format("byte {}", at), ErrorCode::invalidInput,
                          "the file has no 'moov' box");
        return {};
    }

    Result<void> keep(const std::string& type, std::uint64_t offset, std::uint64_t size,
                      bool mediaSeen) {
        const std::string place = fmt::format("{} at byte {}", type, offset);
        if (type == "ftyp") {
            if (size > 4096 || size < 8)
                return failAt(place, ErrorCode::invalidInput, "the box has {} bytes", size);
            Bytes bytes(static_cast<std::size_t>(size));
            STX_CHECK(source_.read(offset, bytes));
            ByteReader in(bytes);
            facts().majorBrand = in.text(4);
            in.skip(4);
            facts().brands.clear();
            while (in.left() >= 4) facts().brands.push_back(in.text(4));
            return {};
        }
        if (!moov_.type.empty())
            return failAt(place, ErrorCode::invalidInput, "the file has a second 'moov' box");
        facts().moovFirst = !mediaSeen;
        // Boxes and tables made of it take a few times its size.
        STX_CHECK(within(place, job_.limits.checkAllocation(size, 4, "the box 'moov'")));
        moovBytes_.resize(static_cast<std::size_t>(size));
        STX_CHECK(source_.read(offset, moovBytes_));
        moov_ = {"moov", "moov", ByteReader(moovBytes_, offset)};
        return {};
    }

    Result<void> readMoov() {
        STX_TRY(const auto boxes, childBoxes(moov_));
        if (const Box* mvex = findBox(boxes, "mvex"))
            return failAt(mvex->place(), ErrorCode::unsupported,
                          "the file is fragmented; rewrite it as one with a single 'moov'");
        if (const Box* cmov = findBox(boxes, "cmov"))
            return failAt(cmov->place(), ErrorCode::unsupported, "the 'moov' box is compressed");
        if (const Box* mvhd = findBox(boxes, "mvhd")) {
            ByteReader in = mvhd->body;
            const bool wide = in.u8() == 1;
            in.skip(wide ? 19 : 11);
            facts().movieTimescale = in.u32();
            facts().movieDuration = wide ? in.u64() : in.u32();
            if (in.failed())
                return failAt(mvhd->place(), ErrorCode::invalidInput, "the box is too short");
        }
        for (const Box& box : boxes) {
            if (box.type != "trak") continue;
            STX_TRY(Mp4Track track, readTrack(box));
            if (!trackOf_.emplace(track.facts.trackId, tracks_.size()).second)
                return failAt(box.place(), ErrorCode::invalidInput, "two tracks have id {}",
                              track.facts.trackId);
            tracks_.push_back(std::move(track));
        }
        if (const Box* iods = findBox(boxes, "iods")) {
            facts().hasIods = true;
            ByteReader in = iods->body;
            in.skip(4);
            const DescriptorContext context{{}, &facts().deviations};
            STX_TRY(auto decoded, within(iods->place(), decodeIod(in.restView(), context)));
            document_.iod = std::move(decoded.iod);
            initialTracks_ = std::move(decoded.trackIds);
        } else {
            addDeviation(
                Deviation::noIods,
                "the file has no initial object descriptor ('iods'); many readers find no scene "
                "then",
                "moov");
        }
        return {};
    }

    Mp4Track* findTrack(std::uint32_t id) {
        const auto found = trackOf_.find(id);
        return found == trackOf_.end() ? nullptr : &tracks_[found->second];
    }

    // ---- streams

    static bool isScene(const Mp4Track& t) {
        return t.facts.handler == "sdsm" || t.stream.streamType == StreamType::sceneDescription;
    }
    static bool isOd(const Mp4Track& t) {
        return t.facts.handler == "odsm" || t.stream.streamType == StreamType::objectDescriptor;
    }

    Result<void> pickStreams() {
        for (const std::uint32_t id : initialTracks_) {
            Mp4Track* track = findTrack(id);
            if (track == nullptr) {
                addDeviation(Deviation::streamNotFound,
                             fmt::format("the IOD names track {}, which is not there", id),
                             "moov/iods");
                continue;
            }
            track->facts.inIods = true;
            if (scene_ == nullptr && isScene(*track))
                scene_ = track;
            else if (isScene(*track) && track != scene_ && track->hasEsds)
                moreScene_.push_back(track);
            else if (od_ == nullptr && isOd(*track))
                od_ = track;
        }
        for (Mp4Track& track : tracks_) {
            if (scene_ == nullptr && isScene(track)) {
                scene_ = &track;
                if (facts().hasIods)
                    addDeviation(Deviation::sceneNotInIods, "the IOD does not name the scene track",
                                 track.path);
            } else if (&track != scene_ && isScene(track) &&
                       std::ranges::find(moreScene_, &track) == moreScene_.end()) {
                job_.note(fmt::format("scene track {} is passed over; the scene is in track {}",
                                      track.facts.trackId, scene_->facts.trackId));
            }
            if (od_ == nullptr && isOd(track) && &track != scene_) od_ = &track;
        }
        if (scene_ == nullptr)
            return failAt(
                "moov", ErrorCode::invalidInput,
                "the file has no MPEG-4 scene: none of its {} tracks is a BIFS stream "
                "(handler 'sdsm'); plain video is taken by stx background, and with a "
                "film of depth by stx convert CAMERAS.json --texture COLOUR --depth DEPTH",
                tracks_.size());
        document_.sceneStream = scene_->stream;
        if (od_ != nullptr)
            document_.odStream = od_->stream;
        else
            addDeviation(
                Deviation::noOdTrack,
                "the file has no object descriptor track; the scene cannot have images in it",
                "moov");
        for (const Mp4Track* track : {scene_, od_})
            if (track != nullptr && track->facts.esIdInEsds != 0)
                addDeviation(Deviation::esIdNotZero,
                             fmt::format("ES_ID in 'esds' is {}, not 0", track->facts.esIdInEsds),
                             track->path);
        return {};
    }

    /// The samples of a track. Each track is read once, however often it is named.
    Result<const std::vector<Sample>*> samplesOf(Mp4Track& track) {
        const auto known = samples_.find(track.facts.trackId);
        if (known != samples_.end()) return &known->second;
        STX_TRY(std::vector<Sample> samples,
                readSamples(track, source_, facts().movieTimescale, job_.limits));
        track.facts.sampleCount = samples.size();
        for (const Sample& sample : samples) track.facts.bytes += sample.data.size;
        return &(samples_[track.facts.trackId] = std::move(samples));
    }

    /// The same of a stream of commands, at the times that its edit list gives them.
    Result<const std::vector<Sample>*> commandsOf(Mp4Track& track) {
        STX_CHECK(samplesOf(track));
        std::vector<Sample>& samples = samples_.at(track.facts.trackId);
        if (!editCommands(track.stream.edits, track.stream.timescale, samples))
            job_.note(
                fmt::format("the edit list of track {} ('{}') is not followed: it leaves commands "
                            "out, or is more than a delay and one edit at normal speed",
                            track.facts.trackId, printable(track.facts.handler)));
        return &samples;
    }

    /// Memory that the document takes by naming a track again and again.
    Result<void> useBudget(std::uint64_t bytes, const std::string& place) {
        spent_ += bytes;
        if (spent_ > job_.limits.maxMemoryBytes)
            return failAt(place, ErrorCode::invalidInput,
                          "the streams need more than the {} bytes that are allowed",
                          job_.limits.maxMemoryBytes);
        return {};
    }

    Result<void> fill(ElementaryStream& stream, const std::string& place) {
        STX_CHECK(useBudget(sizeof(ElementaryStream), place));
        if (!stream.url.empty()) return {};
        Mp4Track* track = findTrack(stream.esId);
        if (track == nullptr) {
            addDeviation(
                Deviation::streamNotFound,
                fmt::format("a descriptor names track {}, which is not there", stream.esId), place);
            return {};
        }
        const bool first = !std::exchange(track->facts.referenced, true);
        if (first) noteEntry(*track);
        if (track->elsewhere) {
            if (first)
                job_.note(
                    fmt::format("the data of track {} are in another file, which is not opened",
                                track->facts.trackId));
            stream = track->stream;
            return {};
        }
        STX_TRY(const std::vector<Sample>* samples, samplesOf(*track));
        STX_CHECK(useBudget(
            samples->size() * sizeof(Sample) + track->stream.decoderSpecificInfo.size(), place));
        stream = track->stream;
        stream.samples = *samples;
        return {};
    }

    void noteEntry(const Mp4Track& track) {
        const bool visual =
            track.stream.streamType == StreamType::visual && track.stream.sampleEntry.empty();
        if (visual && track.facts.sampleEntry == "mp4s")
            addDeviation(Deviation::imageInSystemsEntry,
                         "an image is in a sample entry 'mp4s'; 'mp4v' is expected", track.path);
        if (visual && !track.hasEsds)
            addDeviation(
                Deviation::imageInNativeEntry,
                fmt::format("an image is in a sample entry '{}' without 'esds'; 'mp4v' is expected",
                            printable(track.facts.sampleEntry)),
                track.path);
        if (track.facts.esIdInEsds != 0)
            addDeviation(Deviation::esIdNotZero,
                         fmt::format("ES_ID in 'esds' is {}, not 0", track.facts.esIdInEsds),
                         track.path);
    }

    Result<void> readObjectDescriptors() {
        if (od_ == nullptr) return {};
        STX_TRY(const std::vector<Sample>* samples, commandsOf(*od_));
        document_.odStream.edits = od_->stream.edits;
        document_.odStream.samples = *samples;
        const DescriptorContext context{od_->mpod, &facts().deviations};
        for (std::size_t i = 0; i < samples->size(); ++i) {
            const Sample& sample = (*samples)[i];
            const std::string place =
                fmt::format("OD access unit {} at byte {}", i + 1, sample.data.offset);
            STX_TRY(const Bytes bytes, sample.data.load(job_.limits));
            STX_TRY(auto commands, within(place, decodeOdFrame(bytes, context)));
            for (OdCommand& command : commands) {
                if (auto* update = std::get_if<UpdateObjectDescriptors>(&command))
                    for (ObjectDescriptor& descriptor : update->descriptors)
                        for (ElementaryStream& stream : descriptor.streams)
                            STX_CHECK(fill(stream, place));
                if (auto* update = std::get_if<UpdateStreams>(&command))
                    for (ElementaryStream& stream : update->streams) STX_CHECK(fill(stream, place));
                if (std::holds_alternative<OtherOdCommand>(command))
                    job_.note(fmt::format("OD command {:#04x} is passed over",
                                          std::get<OtherOdCommand>(command).tag));
            }
            document_.odFrames.push_back({sample.time, std::move(commands), sample.sync && i > 0});
        }
        return {};
    }

    Result<void> readScene() {
        if (scene_->elsewhere)
            return failAt(scene_->path, ErrorCode::unsupported,
                          "the scene is in another file, which is not opened");
        if (!scene_->hasEsds)
            return failAt(scene_->path, ErrorCode::invalidInput,
                          "the scene track has no 'esds' box, so no BIFS config");
        STX_TRY(document_.bifsConfig, configOf(*scene_));
        STX_TRY(const std::vector<Sample>* samples, commandsOf(*scene_));
        document_.sceneStream.edits = scene_->stream.edits;
        document_.sceneStream.samples = *samples;
        // Access units of all streams of the scene in the order of time; streams that build on
        // another come behind it.
        std::vector<SceneUnit> units;
        for (const Sample& sample : *samples)
            units.push_back({&sample, sample.time, document_.bifsConfig, true});
        for (Mp4Track* track : moreScene_) {
            auto config = configOf(*track);
            if (!config || track->elsewhere) {
                job_.note(
                    fmt::format("scene track {} is passed over: {}", track->facts.trackId,
                                config ? "its data are in another file" : config.error().text()));
                continue;
            }
            STX_TRY(const std::vector<Sample>* more, commandsOf(*track));
            const double scale = static_cast<double>(scene_->stream.timescale) /
                                 std::max<std::uint32_t>(track->stream.timescale, 1);
            for (const Sample& sample : *more)
                units.push_back({&sample,
                                 static_cast<std::uint64_t>(
                                     std::llround(static_cast<double>(sample.time) * scale)),
                                 *config, false});
            // Nodes and ROUTEs have one space of ids.
            document_.bifsConfig.nodeIdBits =
                std::max(document_.bifsConfig.nodeIdBits, config->nodeIdBits);
            document_.bifsConfig.routeIdBits =
                std::max(document_.bifsConfig.routeIdBits, config->routeIdBits);
            track->facts.referenced = true;
            job_.note(fmt::format("scene track {} is read with track {}, as one stream",
                                  track->facts.trackId, scene_->facts.trackId));
        }
        std::ranges::stable_sort(units, {}, &SceneUnit::time);
        BifsDecoder decoder(document_.bifsConfig, job_.limits);
        for (std::size_t i = 0; i < units.size(); ++i) STX_CHECK(readUnit(decoder, units[i], i));
        if (decoder.renamed() > 0)
            job_.note(
                fmt::format("{} name(s) in Scripts are not JavaScript's; they have '_' for what "
                            "names cannot have",
                            decoder.renamed()));
        return {};
    }

    static Result<BifsConfig> configOf(const Mp4Track& track) {
        const std::uint8_t type = track.stream.objectTypeIndication;
        if (type != oti::kSystemsV1 && type != oti::kSystemsV2 && type != 0xFF)
            return failAt(track.path, ErrorCode::unsupported,
                          "the scene has object type {:#04x}; BIFS is 0x01 or 0x02", type);
        return within(track.path, decodeBifsConfig(track.stream.decoderSpecificInfo, type));
    }

    struct SceneUnit {
        const Sample* sample;
        std::uint64_t time;  ///< in ticks of the scene's stream
        BifsConfig config;
        bool first;  ///< of the stream that the others build on
    };

    Result<void> readUnit(BifsDecoder& decoder, const SceneUnit& unit, std::size_t number) {
        const std::string place =
            fmt::format("BIFS access unit {} at byte {}", number + 1, unit.sample->data.offset);
        STX_TRY(const Bytes bytes, unit.sample->data.load(job_.limits));
        decoder.setConfig(unit.config);
        auto commands = decoder.decode(bytes);
        CommandFrame frame;
        frame.time = unit.time;
        frame.randomAccess = unit.first && unit.sample->sync && number > 0;
        if (commands) {
            frame.commands = std::move(*commands);
        } else {
            // What later ones name may come with one that was not understood.
            frame.commands = decoder.begun();
            const bool carried =
                (number > 0 || !frame.commands.empty()) &&
                (commands.error().code == ErrorCode::unsupported || carriedUnits_ > 0);
            if (!carried) return tl::unexpected(commands.error().at(place));
            if (carriedUnits_++ == 0)
                job_.note(fmt::format(
                    "{}: {}; it stays as it is in an .mp4, has no effect here, and texts do not "
                    "have it, as what builds on it",
                    place, commands.error().text()));
            const auto* from = reinterpret_cast<const std::uint8_t*>(bytes.data());
            frame.coded = CommandBuffer{{from, from + bytes.size()}, decoder.coding()};
        }
        if (commands && decoder.bitsLeft() >= 8)
            addDeviation(Deviation::trailingBytes,
                         fmt::format("{} bits follow the last command", decoder.bitsLeft()), place);
        keepProtos(decoder, frame);
        // One that only declares PROTOs or a quantisation.
        if (frame.commands.empty() && !frame.coded) return {};
        CommandFrame* last = document_.frames.empty() ? nullptr : &document_.frames.back();
        if (!unit.first && last != nullptr && last->time == frame.time && !last->coded &&
            !frame.coded)
            std::ranges::move(frame.commands, std::back_inserter(last->commands));
        else
            document_.frames.push_back(std::move(frame));
        return {};
    }

    /// PROTOs that a command declares are the scene's: who has them early lacks nothing.
    void keepProtos(const BifsDecoder& decoder, CommandFrame& frame) {
        const auto sceneIn = [](CommandFrame& in) -> ReplaceScene* {
            for (auto command = in.commands.rbegin(); command != in.commands.rend(); ++command)
                if (auto* scene = std::get_if<ReplaceScene>(&*command)) return scene;
            return nullptr;
        };
        ReplaceScene* scene = sceneIn(frame);
        const std::size_t count = decoder.protos().size();
        if (count != std::exchange(protoCount_, count))
            for (auto before = document_.frames.rbegin();
                 scene == nullptr && before != document_.frames.rend(); ++before)
                scene = sceneIn(*before);
        if (scene != nullptr && scene->protos.size() != count) scene->protos = decoder.protos();
    }

    const ByteSource& source_;
    Job& job_;
    Document document_;
    Bytes moovBytes_;
    Box moov_;
    std::vector<Mp4Track> tracks_;
    std::unordered_map<std::uint32_t, std::size_t> trackOf_;
    std::unordered_map<std::uint32_t, std::vector<Sample>> samples_;
    std::vector<std::uint32_t> initialTracks_;
    Mp4Track* scene_ = nullptr;
    std::vector<Mp4Track*> moreScene_;  ///< further streams of the scene, which the IOD names
    Mp4Track* od_ = nullptr;
    std::size_t protoCount_ = 0;    ///< that the scene so far declares
    std::size_t carriedUnits_ = 0;  ///< access units of the scene that were not understood
    std::uint64_t spent_ = 0;
};

}  // namespace

bool looksLikeMp4(ByteSpan head) {
    ByteReader in(head);
    in.skip(4);
    const std::string type = in.text(4);
    return type == "ftyp" || type == "moov" || type == "mdat" || type == "pdin";
}

Result<Document> readMp4(const ByteSource& source, Job& job) {
    auto document = Reader(source, job).read();
    if (!document && !source.name().empty())
        return tl::unexpected(document.error().at(fmt::format("'{}'", source.name())));
    return document;
}

Result<ElementaryStream> readMp4Stream(const ByteSource& source, const TrackChoice& choice,
                                       Job& job) {
    auto stream = Reader(source, job).readStream(choice);
    if (!stream && !source.name().empty())
        return tl::unexpected(stream.error().at(fmt::format("'{}'", source.name())));
    return stream;
}

std::vector<const ObjectDescriptor*> Document::objectDescriptors(std::uint64_t until) const {
    std::array<const ObjectDescriptor*, 1024> current{};
    for (const OdFrame& frame : odFrames) {
        if (frame.time > until) continue;
        for (const OdCommand& command : frame.commands) {
            if (const auto* update = std::get_if<UpdateObjectDescriptors>(&command)) {
                for (const ObjectDescriptor& descriptor : update->descriptors)
                    if (descriptor.id >= 0 && descriptor.id < 1024)
                        current[descriptor.id] = &descriptor;
            } else if (const auto* removal = std::get_if<RemoveObjectDescriptors>(&command)) {
                for (const int id : removal->ids)
                    if (id >= 0 && id < 1024) current[id] = nullptr;
            }
        }
    }
    std::vector<const ObjectDescriptor*> present;
    for (const ObjectDescriptor* descriptor : current)
        if (descriptor != nullptr) present.push_back(descriptor);
    return present;
}

const ObjectDescriptor* Document::findObjectDescriptor(int id) const {
    for (const ObjectDescriptor* descriptor : objectDescriptors())
        if (descriptor->id == id) return descriptor;
    return nullptr;
}

}  // namespace stx::mpeg4
