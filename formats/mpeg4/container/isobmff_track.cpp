#include "formats/mpeg4/container/isobmff_track.hpp"

#include <algorithm>
#include <limits>
#include <unordered_map>

#include "formats/mpeg4/bifs/descriptors.hpp"
#include "lib/base/printable.hpp"

namespace stx::mpeg4 {
namespace {

/// Boxes beside each other; far above what a file with as many tracks as it may have views needs.
constexpr std::size_t kMaxBoxes = 200'000;

template <class... Args>
tl::unexpected<Error> damaged(const Box& box, fmt::format_string<Args...> format, Args&&... args) {
    return failAt(box.place(), ErrorCode::invalidInput, format, std::forward<Args>(args)...);
}

/// Version and flags of a full box.
struct FullBox {
    std::uint8_t version = 0;
    std::uint32_t flags = 0;
};
FullBox fullBox(ByteReader& in) {
    FullBox head;
    head.version = in.u8();
    head.flags = in.u24();
    return head;
}

Result<std::vector<Box>> childrenOf(const Box* parent, const Box& owner, std::string_view type) {
    if (parent == nullptr) return damaged(owner, "the box '{}' is missing", type);
    return childBoxes(*parent);
}

/// The entries of a table of fixed-size rows, after its count was held against the box.
Result<ByteReader> tableOf(const Box& box, std::size_t bytesEach, std::uint64_t& count) {
    ByteReader in = box.body;
    fullBox(in);
    count = in.u32();
    if (in.failed() || count * bytesEach > in.left())
        return damaged(box, "{} entries of {} bytes do not fit into the {} bytes of the box", count,
                       bytesEach, in.left());
    return in;
}

Result<void> readHeaders(const Box& trak, const std::vector<Box>& boxes,
                         const std::vector<Box>& media, Mp4Track& track) {
    const Box* tkhd = findBox(boxes, "tkhd");
    const Box* mdhd = findBox(media, "mdhd");
    const Box* hdlr = findBox(media, "hdlr");
    for (const auto& [box, type] : {std::pair{tkhd, "tkhd"}, {mdhd, "mdhd"}, {hdlr, "hdlr"}})
        if (box == nullptr) return damaged(trak, "the box '{}' is missing", type);

    ByteReader in = tkhd->body;
    in.skip(fullBox(in).version == 1 ? 16 : 8);
    track.facts.trackId = in.u32();
    if (in.failed()) return damaged(*tkhd, "the box is too short");
    if (track.facts.trackId == 0) return damaged(*tkhd, "the track has id 0");

    in = mdhd->body;
    in.skip(fullBox(in).version == 1 ? 16 : 8);
    track.stream.timescale = in.u32();
    if (in.failed()) return damaged(*mdhd, "the box is too short");
    if (track.stream.timescale == 0) return damaged(*mdhd, "the timescale is 0");

    in = hdlr->body;
    in.skip(8);
    track.facts.handler = in.text(4);
    if (in.failed()) return damaged(*hdlr, "the box is too short");
    in.skip(12);
    if (!in.failed()) {
        track.facts.handlerName = in.text(in.left());
        track.facts.handlerName.resize(
            std::min(track.facts.handlerName.find('\0'), track.facts.handlerName.size()));
    }
    return {};
}

Result<void> readReferences(const std::vector<Box>& boxes, Mp4Track& track) {
    const Box* tref = findBox(boxes, "tref");
    if (tref == nullptr) return {};
    STX_TRY(const auto references, childBoxes(*tref));
    if (const Box* mpod = findBox(references, "mpod")) {
        ByteReader in = mpod->body;
        while (in.left() >= 4) track.mpod.push_back(in.u32());
    }
    // In files the clock's stream is named here (ISO/IEC 14496-14, 3.1.2), not by the descriptor.
    if (const Box* sync = findBox(references, "sync")) {
        ByteReader in = sync->body;
        const std::uint32_t id = in.u32();
        if (!in.failed() && id > 0 && id <= 0xFFFF) track.clock = static_cast<std::uint16_t>(id);
    }
    return {};
}

/// Bytes between the data reference index and the boxes of a sample entry.
std::optional<std::size_t> entryHeader(std::string_view entry, std::string_view handler) {
    if (entry == "mp4s") return 0;
    if (handler == "vide" || handler == "pict" || entry == "mp4v" || entry == "jpeg" ||
        entry == "png ")
        return 70;
    if (handler == "soun" || entry == "mp4a") return 20;
    return std::nullopt;
}

/// The entries that are written anew from their descriptor; others are kept as they are.
bool isOurEntry(std::string_view entry) {
    return entry == "mp4s" || entry == "mp4v" || entry == "jpeg" || entry == "png ";
}

/// Keeps the bytes of the entry, which has one data reference in what we write, and takes the
/// decoder's config out of it where we know its place.
Result<void> keepEntry(const Box& entry, const std::vector<Box>& inner, Mp4Track& track) {
    const ByteSpan body = entry.body.restView();
    Bytes& bytes = track.stream.sampleEntry;
    bytes.assign(8 + body.size(), std::byte{0});
    for (std::size_t i = 0; i < 4; ++i) {
        bytes[i] = static_cast<std::byte>(bytes.size() >> (24 - 8 * i) & 0xFF);
        bytes[4 + i] = static_cast<std::byte>(entry.type[i]);
    }
    std::copy(body.begin(), body.end(), bytes.begin() + 8);
    bytes[14] = std::byte{0};
    bytes[15] = std::byte{1};
    track.stream.handler = track.facts.handler;
    if (track.hasEsds) return {};
    const bool avc = entry.type == "avc1" || entry.type == "avc3";
    const bool hevc = entry.type == "hvc1" || entry.type == "hev1";
    if (avc || hevc) {
        track.stream.objectTypeIndication = avc ? oti::kAvc : oti::kHevc;
        if (const Box* config = findBox(inner, avc ? "avcC" : "hvcC")) {
            const ByteSpan record = config->body.restView();
            track.stream.decoderSpecificInfo.assign(record.begin(), record.end());
        }
    }
    track.stream.streamType = track.facts.handler == "vide"   ? StreamType::visual
                              : track.facts.handler == "soun" ? StreamType::audio
                                                              : StreamType::none;
    return {};
}

Result<void> readSampleEntry(const Box& stsd, const Box& dref, Mp4Track& track) {
    Box entries = stsd;
    fullBox(entries.body);
    const std::uint32_t count = entries.body.u32();
    if (entries.body.failed() || count == 0)
        return damaged(stsd, "it has no sample entry; one is expected");
    STX_TRY(const auto boxes, childBoxes(entries));
    if (boxes.empty()) return damaged(stsd, "it announces {} sample entries and has none", count);
    track.entries = boxes;
    Box entry = boxes.front();
    const Box whole = entry;
    track.facts.sampleEntry = entry.type;
    if (entry.type == "encv" || entry.type == "enca" || entry.type == "encs")
        return failAt(entry.place(), ErrorCode::unsupported, "the track is encrypted");

    ByteReader& in = entry.body;
    in.skip(6);
    const std::uint16_t reference = in.u16();
    const auto header = entryHeader(entry.type, track.facts.handler);
    if (header == 70) {
        in.skip(16);
        track.stream.width = in.u16();
        track.stream.height = in.u16();
        in.skip(50);
    } else if (header) {
        in.skip(*header);
    }
    if (in.failed()) return damaged(entry, "the sample entry is too short");

    if (!dref.type.empty()) {
        Box references = dref;
        fullBox(references.body);
        references.body.u32();
        STX_TRY(const auto urls, childBoxes(references));
        if (reference == 0 || reference > urls.size())
            return damaged(entry, "data reference {} is not among the {} of the track", reference,
                           urls.size());
        ByteReader url = urls[reference - 1u].body;
        track.elsewhere = (fullBox(url).flags & 1) == 0;
    }

    if (entry.type == "jpeg" || entry.type == "png ") {
        track.stream.objectTypeIndication = entry.type == "jpeg" ? oti::kJpeg : oti::kPng;
        track.stream.streamType = StreamType::visual;
    }
    if (!header) return keepEntry(whole, {}, track);
    // The boxes of an entry that we only pass on may be in a form that we do not know.
    auto children = childBoxes(entry);
    if (!children && !isOurEntry(entry.type)) return keepEntry(whole, {}, track);
    STX_TRY(const auto inner, std::move(children));
    if (findBox(inner, "sinf") != nullptr)
        return failAt(entry.place(), ErrorCode::unsupported, "the track is encrypted");
    const Box* esds = findBox(inner, "esds");
    if (esds == nullptr)
        return isOurEntry(entry.type) ? Result<void>{} : keepEntry(whole, inner, track);
    track.hasEsds = true;
    ByteReader body = esds->body;
    fullBox(body);
    if (body.failed()) return damaged(*esds, "the box is too short");
    STX_TRY(auto stream, within(esds->place(), decodeEsDescriptor(body.restView())));
    stream.timescale = track.stream.timescale;
    stream.width = track.stream.width;
    stream.height = track.stream.height;
    track.facts.esIdInEsds = stream.esId;
    track.stream = std::move(stream);
    if (!isOurEntry(entry.type)) return keepEntry(whole, inner, track);
    return {};
}

}  // namespace

Result<std::vector<Box>> childBoxes(const Box& parent) {
    std::vector<Box> boxes;
    std::unordered_map<std::string, int> seen;
    ByteReader in = parent.body;
    while (in.left() > 0) {
        const std::uint64_t start = in.offset();
        const std::size_t available = in.left();
        const auto place = [&] { return fmt::format("{} at byte {}", parent.path, start); };
        // Some writers end a container with 4 zero bytes.
        if (available == 4 && in.u32() == 0) break;
        std::uint64_t size = available >= 8 ? in.u32() : 0;
        Box box;
        box.type = in.text(4);
        if (available < 8)
            return failAt(place(), ErrorCode::invalidInput, "{} bytes are left, too few for a box",
                          available);
        std::uint64_t header = 8;
        if (size == 1) {
            size = in.u64();
            header = 16;
        } else if (size == 0) {
            size = available;
        }
        if (in.failed() || size < header || size > available)
            return failAt(place(), ErrorCode::invalidInput,
                          "the box '{}' claims {} bytes; {} are left in its parent",
                          printable(box.type), size, available);
        const int number = ++seen[box.type];
        if (boxes.size() >= kMaxBoxes)
            return failAt(place(), ErrorCode::invalidInput,
                          "there are more than {} boxes side by side", kMaxBoxes);
        box.path = parent.path.empty() ? printable(box.type)
                                       : fmt::format("{}/{}", parent.path, printable(box.type));
        if (box.type == "trak" || number > 1) box.path += fmt::format("[{}]", number);
        box.body = in.sub(static_cast<std::size_t>(size - header));
        boxes.push_back(std::move(box));
    }
    return boxes;
}

const Box* findBox(const std::vector<Box>& boxes, std::string_view type) {
    for (const Box& box : boxes)
        if (box.type == type) return &box;
    return nullptr;
}

Result<Mp4Track> readTrack(const Box& trak) {
    Mp4Track track;
    track.path = trak.path;
    STX_TRY(const auto boxes, childBoxes(trak));
    const Box* mdia = findBox(boxes, "mdia");
    STX_TRY(const auto media, childrenOf(mdia, trak, "mdia"));
    STX_CHECK(readHeaders(trak, boxes, media, track));
    STX_CHECK(readReferences(boxes, track));
    const Box* minf = findBox(media, "minf");
    STX_TRY(const auto information, childrenOf(minf, *mdia, "minf"));
    const Box* stbl = findBox(information, "stbl");
    STX_TRY(const auto tables, childrenOf(stbl, *minf, "stbl"));
    Box dref;
    if (const Box* dinf = findBox(information, "dinf")) {
        STX_TRY(const auto inner, childBoxes(*dinf));
        if (const Box* found = findBox(inner, "dref")) dref = *found;
    }
    const Box* stsd = findBox(tables, "stsd");
    if (stsd == nullptr) return damaged(*stbl, "the box 'stsd' is missing");
    STX_CHECK(readSampleEntry(*stsd, dref, track));
    if (track.clock) track.stream.ocrEsId = track.clock;
    track.facts.objectTypeIndication = track.stream.objectTypeIndication;
    track.facts.streamType = static_cast<std::uint8_t>(track.stream.streamType);
    track.stream.esId = track.facts.trackId;

    const auto keep = [&](Box& slot, std::initializer_list<std::string_view> types) {
        for (const std::string_view type : types)
            if (const Box* found = findBox(tables, type); found != nullptr && slot.type.empty())
                slot = *found;
    };
    keep(track.stts, {"stts"});
    keep(track.stsc, {"stsc"});
    keep(track.stsz, {"stsz", "stz2"});
    keep(track.stco, {"stco", "co64"});
    keep(track.ctts, {"ctts"});
    keep(track.stss, {"stss"});
    if (const Box* edts = findBox(boxes, "edts")) {
        STX_TRY(const auto inner, childBoxes(*edts));
        if (const Box* elst = findBox(inner, "elst")) track.elst = *elst;
    }
    return track;
}

// ---- samples

namespace {

/// Sizes of the samples of a track, whichever of the three forms they have.
class SampleSizes {
  public:
    static Result<SampleSizes> read(const Box& box) {
        SampleSizes sizes;
        ByteReader in = box.body;
        fullBox(in);
        if (box.type == "stz2") {
            in.skip(3);
            sizes.fieldBits_ = in.u8();
            if (sizes.fieldBits_ != 4 && sizes.fieldBits_ != 8 && sizes.fieldBits_ != 16)
                return damaged(box, "sizes of {} bits are not possible", sizes.fieldBits_);
        } else {
            sizes.common_ = in.u32();
        }
        sizes.count_ = in.u32();
        const std::uint64_t bits =
            sizes.common_ != 0 ? 0 : sizes.count_ * static_cast<std::uint64_t>(sizes.fieldBits_);
        if (in.failed() || (bits + 7) / 8 > in.left())
            return damaged(box, "{} sample sizes do not fit into the {} bytes of the box",
                           sizes.count_, in.left());
        sizes.table_ = in;
        return sizes;
    }

    [[nodiscard]] std::uint64_t count() const { return count_; }
    [[nodiscard]] std::uint64_t total() {
        if (common_ != 0) return count_ * common_;
        std::uint64_t sum = 0;
        for (std::uint64_t i = 0; i < count_; ++i) sum += next();
        return sum;
    }

    std::uint32_t next() {
        if (common_ != 0) return common_;
        if (fieldBits_ == 32) return table_.u32();
        if (fieldBits_ == 16) return table_.u16();
        if (fieldBits_ == 8) return table_.u8();
        half_ = !half_;
        if (!half_) return pair_ & 0x0F;
        pair_ = table_.u8();
        return pair_ >> 4;
    }

  private:
    std::uint32_t common_ = 0;
    std::uint64_t count_ = 0;
    int fieldBits_ = 32;
    ByteReader table_;
    bool half_ = false;
    std::uint8_t pair_ = 0;
};

/// Errors: (invalidInput) a sample entry that is not there, (unsupported) one that is not the first
/// to the byte, by which all samples are decoded. A single entry serves whatever is named.
Result<void> checkEntry(const Mp4Track& track, std::uint64_t chunk, std::uint32_t number) {
    const std::vector<Box>& entries = track.entries;
    if (entries.size() < 2) return {};
    if (number == 0 || number > entries.size())
        return damaged(track.stsc, "chunk {} is of sample entry {}, but there are {}", chunk,
                       number, entries.size());
    const Box &first = entries.front(), &own = entries[number - 1];
    if (own.type == first.type && std::ranges::equal(own.body.restView(), first.body.restView()))
        return {};
    return failAt(track.stsc.place(), ErrorCode::unsupported,
                  "chunk {} is of sample entry {} ('{}'), which is not the first ('{}') again; all "
                  "samples of a track are decoded with one: code its pictures anew as one stream",
                  chunk, number, printable(own.type), printable(first.type));
}

Result<void> place(const Mp4Track& track, SampleSizes sizes, const ByteSource& source,
                   std::vector<Sample>& samples) {
    std::uint64_t chunks = 0;
    const bool wide = track.stco.type == "co64";
    STX_TRY(ByteReader offsets, tableOf(track.stco, wide ? 8 : 4, chunks));
    std::uint64_t runs = 0;
    STX_TRY(ByteReader table, tableOf(track.stsc, 12, runs));
    if (runs == 0) return damaged(track.stsc, "the table is empty");

    std::uint32_t first = table.u32();
    if (first != 1) return damaged(track.stsc, "the first chunk is {}, not 1", first);
    std::uint32_t perChunk = table.u32();
    STX_CHECK(checkEntry(track, 1, table.u32()));
    std::uint64_t nextRun = runs > 1 ? table.u32() : 0;
    std::uint64_t run = 1;
    std::uint64_t total = 0;
    for (std::uint64_t chunk = 1; chunk <= chunks && samples.size() < sizes.count(); ++chunk) {
        if (nextRun == chunk) {
            perChunk = table.u32();
            STX_CHECK(checkEntry(track, chunk, table.u32()));
            ++run;
            const std::uint64_t after = run < runs ? table.u32() : 0;
            if (after != 0 && after <= chunk)
                return damaged(track.stsc, "chunk {} follows chunk {}", after, chunk);
            nextRun = after;
        } else if (nextRun != 0 && nextRun < chunk) {
            return damaged(track.stsc, "chunk {} follows chunk {}", nextRun, chunk - 1);
        }
        std::uint64_t offset = wide ? offsets.u64() : offsets.u32();
        for (std::uint32_t i = 0; i < perChunk && samples.size() < sizes.count(); ++i) {
            const std::uint32_t size = sizes.next();
            if (offset > source.size() || size > source.size() - offset)
                return damaged(
                    track.stco,
                    "sample {} is {} bytes at byte {}, past the end of the file ({} bytes)",
                    samples.size() + 1, size, offset, source.size());
            total += size;
            if (total > source.size())
                return damaged(track.stsz,
                               "the samples have more bytes together than the file ({})",
                               source.size());
            Sample sample;
            sample.data = ByteRange(source, offset, size);
            samples.push_back(std::move(sample));
            offset += size;
        }
    }
    if (samples.size() < sizes.count())
        return damaged(track.stsc, "the {} chunks hold {} samples, but there are {}", chunks,
                       samples.size(), sizes.count());
    return {};
}

Result<void> time(const Mp4Track& track, std::vector<Sample>& samples) {
    std::uint64_t runs = 0;
    STX_TRY(ByteReader table, tableOf(track.stts, 8, runs));
    std::uint64_t at = 0;
    std::size_t sample = 0;
    for (std::uint64_t run = 0; run < runs && sample < samples.size(); ++run) {
        const std::uint32_t count = table.u32();
        const std::uint32_t delta = table.u32();
        for (std::uint32_t i = 0; i < count && sample < samples.size(); ++i, ++sample) {
            samples[sample].time = at;
            samples[sample].duration = delta;
            at += delta;
        }
    }
    if (sample < samples.size())
        return damaged(track.stts, "the table times {} samples, but there are {}", sample,
                       samples.size());

    if (!track.ctts.type.empty()) {
        STX_TRY(ByteReader offsets, tableOf(track.ctts, 8, runs));
        sample = 0;
        for (std::uint64_t run = 0; run < runs && sample < samples.size(); ++run) {
            const std::uint32_t count = offsets.u32();
            const auto offset = static_cast<std::int32_t>(offsets.u32());
            for (std::uint32_t i = 0; i < count && sample < samples.size(); ++i)
                samples[sample++].compositionOffset = offset;
        }
    }
    if (!track.stss.type.empty()) {
        STX_TRY(ByteReader numbers, tableOf(track.stss, 4, runs));
        for (Sample& s : samples) s.sync = false;
        for (std::uint64_t i = 0; i < runs; ++i) {
            const std::uint32_t number = numbers.u32();
            if (number >= 1 && number <= samples.size()) samples[number - 1].sync = true;
        }
    }
    return {};
}

/// Puts the edit list into the times of the samples where it only delays them, else into the
/// stream.
Result<void> edit(Mp4Track& track, std::uint32_t movieTimescale, const Limits& limits,
                  std::vector<Sample>& samples) {
    if (track.elst.type.empty()) return {};
    const bool wide = ByteReader(track.elst.body).u8() == 1;
    std::uint64_t count = 0;
    STX_TRY(ByteReader table, tableOf(track.elst, wide ? 20 : 12, count));
    STX_CHECK(
        within(track.elst.place(), limits.checkAllocation(count, sizeof(Edit), "the edit list")));
    EditList list{movieTimescale, {}};
    for (std::uint64_t i = 0; i < count; ++i) {
        Edit one;
        one.duration = wide ? table.u64() : table.u32();
        one.mediaTime =
            wide ? static_cast<std::int64_t>(table.u64()) : static_cast<std::int32_t>(table.u32());
        one.rate = table.u32();
        list.edits.push_back(one);
    }
    const bool delayed = list.edits.size() == 2 && list.edits[0].mediaTime == -1;
    const std::uint64_t length =
        samples.empty() ? 0 : samples.back().time + samples.back().duration;
    const Edit* shown = list.edits.size() == (delayed ? 2u : 1u) ? &list.edits.back() : nullptr;
    // All of the track, but for a tick of rounding: in seconds, since the numbers may be anything.
    const bool whole =
        shown != nullptr && shown->mediaTime == 0 && shown->rate == 0x10000 && movieTimescale > 0 &&
        (shown->duration == 0 || static_cast<double>(shown->duration + 1) / movieTimescale >=
                                     static_cast<double>(length) / track.stream.timescale);
    const std::uint64_t delay = delayed ? list.edits[0].duration : 0;
    if (whole && delay <= std::numeric_limits<std::uint32_t>::max() &&
        delay * track.stream.timescale % movieTimescale == 0) {
        for (Sample& sample : samples)
            sample.time += delay * track.stream.timescale / movieTimescale;
    } else if (movieTimescale > 0) {
        track.stream.edits = std::move(list);
    }
    return {};
}

}  // namespace

Result<std::vector<Sample>> readSamples(Mp4Track& track, const ByteSource& source,
                                        std::uint32_t movieTimescale, const Limits& limits) {
    std::vector<Sample> samples;
    if (track.stsz.type.empty())
        return failAt(track.path, ErrorCode::invalidInput,
                      "the track has no sample sizes ('stsz' or 'stz2')");
    STX_TRY(SampleSizes sizes, SampleSizes::read(track.stsz));
    if (sizes.count() == 0) return samples;
    for (const auto& [box, type] :
         {std::pair{&track.stts, "stts"}, {&track.stsc, "stsc"}, {&track.stco, "stco"}})
        if (box->type.empty())
            return failAt(track.path, ErrorCode::invalidInput, "the track has samples but no '{}'",
                          type);
    STX_CHECK(within(track.stsz.place(),
                     limits.checkAllocation(sizes.count(), sizeof(Sample), "the samples")));
    STX_CHECK(place(track, sizes, source, samples));
    STX_CHECK(time(track, samples));
    STX_CHECK(edit(track, movieTimescale, limits, samples));
    return samples;
}

bool editCommands(EditList& edits, std::uint32_t timescale, std::vector<Sample>& samples) {
    const std::vector<Edit>& list = edits.edits;
    if (list.empty()) return true;
    const bool delayed = list.size() == 2 && list[0].mediaTime == -1;
    const Edit& shown = list.back();
    if (list.size() != (delayed ? 2u : 1u) || shown.mediaTime < 0 || shown.rate != 0x10000 ||
        edits.timescale == 0 || list[0].duration > std::numeric_limits<std::uint32_t>::max())
        return false;
    const double ticks = static_cast<double>(timescale) / edits.timescale;
    const double delay = delayed ? std::round(static_cast<double>(list[0].duration) * ticks) : 0;
    // Its end was rounded to a tick of the movie, as writers do.
    const double end = (static_cast<double>(shown.duration) + 0.5) * ticks;
    const auto from = static_cast<std::uint64_t>(shown.mediaTime);
    const auto inEdit = [&](const Sample& sample) {
        return sample.time > from ? sample.time - from : 0;
    };
    for (const Sample& sample : samples)
        if (shown.duration != 0 && static_cast<double>(inEdit(sample)) >= end) return false;
    for (Sample& sample : samples) sample.time = static_cast<std::uint64_t>(delay) + inEdit(sample);
    edits = {};
    return true;
}

void sumSamples(Mp4Track& track) {
    if (track.stsz.type.empty()) return;
    auto sizes = SampleSizes::read(track.stsz);
    if (!sizes) return;
    track.facts.sampleCount = static_cast<std::size_t>(sizes->count());
    track.facts.bytes = sizes->total();
}

}  // namespace stx::mpeg4
