#pragma once

#include <optional>
#include <string>
#include <vector>

#include "formats/files/byte_io.hpp"
#include "formats/mpeg4/scene/document.hpp"

/// Inside of the MP4 reader: boxes, and tracks by their tables.
namespace stx::mpeg4 {

/// A box inside a parent that is in memory.
struct Box {
    std::string type;  ///< four characters
    std::string path;  ///< "moov/trak[2]/mdia", for messages
    ByteReader body;   ///< after the header; offset() is the place in the file

    [[nodiscard]] std::string place() const {
        return fmt::format("{} at byte {}", path, body.offset());
    }
};

/// The boxes that fill `parent` from its current position. Errors (invalidInput) when a size does
/// not fit.
[[nodiscard]] Result<std::vector<Box>> childBoxes(const Box& parent);
/// The first of a type, null when there is none.
[[nodiscard]] const Box* findBox(const std::vector<Box>& boxes, std::string_view type);

/// A track without its samples, whose tables stay as bytes until someone wants them.
struct Mp4Track {
    TrackFacts facts;
    ElementaryStream stream;  ///< from the sample entry; no samples yet
    std::vector<std::uint32_t> mpod;
    std::optional<std::uint16_t> clock;  ///< tref/sync: whose clock it has
    bool hasEsds = false;
    bool elsewhere = false;  ///< the data are in another file, which is not opened
    std::string path;

    std::vector<Box> entries;                      ///< of samples; all that are used are alike
    Box stts, stsc, stsz, stco, ctts, stss, elst;  ///< type empty: not there
};

[[nodiscard]] Result<Mp4Track> readTrack(const Box& trak);

/// The samples of a track, each held against the size of the file, at the times that its edit list
/// gives them; an edit list that is more than a delay goes into track.stream.edits, its durations
/// in `movieTimescale`. Errors (invalidInput) when the tables disagree, reach outside the file, or
/// need more memory than limits allow.
[[nodiscard]] Result<std::vector<Sample>> readSamples(Mp4Track& track, const ByteSource& source,
                                                      std::uint32_t movieTimescale,
                                                      const Limits& limits);

/// Puts the edit list of a stream of commands (a scene's, or its object descriptors') into their
/// times: what comes before an edit acts at its start, as a scene is the sum of its commands. True
/// where the stream has no edits then; false, and nothing changes, where the list is more than one
/// edit at normal speed behind a delay, or leaves commands out.
[[nodiscard]] bool editCommands(EditList& edits, std::uint32_t timescale,
                                std::vector<Sample>& samples);

/// Fills in facts.sampleCount and facts.bytes from the table of sizes alone; leaves them 0 where it
/// is damaged. For tracks that nobody reads.
void sumSamples(Mp4Track& track);

}  // namespace stx::mpeg4
