#include "formats/mpeg4/container/movie_boxes.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

#include "formats/files/source_date.hpp"
#include "formats/mpeg4/bifs/descriptors.hpp"

namespace stx::mpeg4 {
namespace {

/// What most files have. Where a delay or an edit is not a number of such ticks, they are finer.
constexpr std::uint32_t kMovieTimescale = 600;
constexpr std::uint64_t kFinestTimescale = 1'000'000'000;

/// Seconds from 1904 to 1970.
constexpr std::uint64_t kEpochOffset = 2082844800;

/// What SOURCE_DATE_EPOCH says, in the file's epoch; 0 without it, or behind 2040, where 32 bits
/// end.
std::uint64_t creationTime() {
    const auto seconds = sourceDate();
    const std::uint64_t created = seconds.value_or(0) + kEpochOffset;
    return seconds && created <= std::numeric_limits<std::uint32_t>::max() ? created : 0;
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

bool isSystems(const WrittenTrack& track) {
    return track.stream.streamType != StreamType::visual;
}

/// `ticks` of `from` in ticks of `to`, rounded down.
std::uint64_t rescaled(std::uint64_t ticks, std::uint32_t from, std::uint32_t to) {
    return ticks / from * to + ticks % from * to / from;
}

/// The edit list that a track gets: its own, or one that delays it.
EditList editsOf(const WrittenTrack& track, std::uint32_t timescale) {
    EditList list{timescale, {}};
    const ElementaryStream& stream = track.stream;
    if (track.start > 0)
        list.edits.push_back({rescaled(track.start, stream.timescale, timescale), -1, 0x10000});
    for (const Edit& edit : stream.edits.edits) {
        list.edits.push_back(edit);
        list.edits.back().duration = rescaled(edit.duration, stream.edits.timescale, timescale);
    }
    if (!list.edits.empty() && stream.edits.edits.empty())
        list.edits.push_back({rescaled(track.duration, stream.timescale, timescale), 0, 0x10000});
    return list;
}

std::uint64_t movieDuration(const WrittenTrack& track, std::uint32_t timescale) {
    std::uint64_t duration = 0;
    for (const Edit& edit : editsOf(track, timescale).edits) duration += edit.duration;
    return duration > 0 ? duration : rescaled(track.duration, track.stream.timescale, timescale);
}

/// A timescale in which every delay and every edit is a whole number, as far as one is fine enough.
std::uint32_t movieTimescale(std::span<const WrittenTrack> tracks) {
    std::uint64_t timescale = kMovieTimescale;
    const auto include = [&](std::uint64_t ticks, std::uint64_t each) {
        if (ticks == 0 || each == 0) return;
        const std::uint64_t finer = std::lcm(timescale, each / std::gcd(ticks, each));
        if (finer <= kFinestTimescale) timescale = finer;
    };
    for (const WrittenTrack& track : tracks) {
        include(track.start, track.stream.timescale);
        for (const Edit& edit : track.stream.edits.edits)
            include(edit.duration, track.stream.edits.timescale);
    }
    return static_cast<std::uint32_t>(timescale);
}

void writeEdits(ByteWriter& out, const EditList& list) {
    if (list.edits.empty()) return;
    const bool wide = std::any_of(list.edits.begin(), list.edits.end(), [](const Edit& e) {
        return e.duration > std::numeric_limits<std::uint32_t>::max() ||
               e.mediaTime != static_cast<std::int32_t>(e.mediaTime);
    });
    const BoxScope edts(out, "edts");
    const BoxScope elst(out, "elst", wide ? 1 : 0, 0);
    out.u32(static_cast<std::uint32_t>(list.edits.size()));
    for (const Edit& edit : list.edits) {
        if (wide) {
            out.u64(edit.duration);
            out.u64(static_cast<std::uint64_t>(edit.mediaTime));
        } else {
            out.u32(static_cast<std::uint32_t>(edit.duration));
            out.u32(static_cast<std::uint32_t>(edit.mediaTime));
        }
        out.u32(edit.rate);
    }
}

/// Version 1 boxes carry times of 64 bits; version 0 is used where it suffices.
void writeTimes(ByteWriter& out, bool wide, std::uint32_t between, bool reserved,
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
bool needsWide(std::uint64_t duration) {
    return duration > std::numeric_limits<std::uint32_t>::max();
}

void writeMatrix(ByteWriter& out) {
    for (const std::uint32_t value : {0x10000u, 0u, 0u, 0u, 0x10000u, 0u, 0u, 0u, 0x40000000u})
        out.u32(value);
}

void writeMovieHeader(ByteWriter& out, std::uint32_t timescale, std::uint64_t duration,
                      std::uint32_t highestId) {
    const bool wide = needsWide(duration);
    const BoxScope mvhd(out, "mvhd", wide ? 1 : 0, 0);
    writeTimes(out, wide, timescale, false, duration);
    out.u32(0x10000);
    out.u16(0x0100);
    out.zeros(10);
    writeMatrix(out);
    out.zeros(24);
    out.u32(highestId == std::numeric_limits<std::uint32_t>::max() ? highestId : highestId + 1);
}

Result<void> writeSampleEntry(ByteWriter& out, const WrittenTrack& track) {
    if (!track.stream.sampleEntry.empty()) {
        const BoxScope stsd(out, "stsd", 0, 0);
        out.u32(1);
        out.bytes(track.stream.sampleEntry);
        return {};
    }
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

void writeRuns(ByteWriter& out, const std::vector<std::uint32_t>& values) {
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

void writeTables(ByteWriter& out, const WrittenTrack& track, bool wide) {
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

Result<void> writeTrack(ByteWriter& out, const WrittenTrack& track, std::uint32_t timescale,
                        bool wide) {
    const BoxScope trak(out, "trak");
    {
        const std::uint64_t duration = movieDuration(track, timescale);
        // Enabled; in the movie and in its preview, too.
        const std::uint32_t flags = isSystems(track) || !track.stream.inMovie ? 1 : 7;
        const BoxScope tkhd(out, "tkhd", needsWide(duration) ? 1 : 0, flags);
        writeTimes(out, needsWide(duration), track.id, true, duration);
        out.zeros(16);  // layer, alternate group and volume with what is reserved around them
        writeMatrix(out);
        out.u32(static_cast<std::uint32_t>(track.stream.width) << 16);
        out.u32(static_cast<std::uint32_t>(track.stream.height) << 16);
    }
    if (!track.mpod.empty() || track.clock != 0) {
        const BoxScope tref(out, "tref");
        if (!track.mpod.empty()) {
            const BoxScope mpod(out, "mpod");
            for (const std::uint32_t id : track.mpod) out.u32(id);
        }
        if (track.clock != 0) {
            const BoxScope sync(out, "sync");
            out.u32(track.clock);
        }
    }
    writeEdits(out, editsOf(track, timescale));
    const BoxScope mdia(out, "mdia");
    {
        const BoxScope mdhd(out, "mdhd", needsWide(track.duration) ? 1 : 0, 0);
        writeTimes(out, needsWide(track.duration), track.stream.timescale, false, track.duration);
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
    if (track.handler == "vide") {
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

}  // namespace

Result<void> writeMovieHead(ByteWriter& out, std::span<const WrittenTrack> tracks,
                            const InitialObjectDescriptor* iod, bool wide) {
    const std::uint32_t timescale = movieTimescale(tracks);
    {
        const BoxScope ftyp(out, "ftyp");
        out.text("mp42");
        out.u32(1);
        out.text("isommp42mp41");
    }
    const BoxScope moov(out, "moov");
    std::uint64_t duration = 0;
    std::uint32_t highest = 0;
    for (const WrittenTrack& track : tracks) {
        duration = std::max(duration, movieDuration(track, timescale));
        highest = std::max(highest, track.id);
    }
    writeMovieHeader(out, timescale, duration, highest);
    if (iod != nullptr) {
        const BoxScope iods(out, "iods", 0, 0);
        std::vector<std::uint32_t> initial;
        for (const WrittenTrack& track : tracks)
            if (track.handler == "sdsm" || track.handler == "odsm") initial.push_back(track.id);
        STX_TRY(const Bytes descriptor, encodeIod(*iod, initial));
        out.bytes(descriptor);
    }
    for (const WrittenTrack& track : tracks) STX_CHECK(writeTrack(out, track, timescale, wide));
    return {};
}

}  // namespace stx::mpeg4
