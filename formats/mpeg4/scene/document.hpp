#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "formats/files/byte_source.hpp"
#include "formats/mpeg4/scene/scene.hpp"

// clang-format off
/// A whole MPEG-4 presentation in memory: what an .mp4, .bt or .xmt file says. The readers of all
/// three make a Document, the writers of all three take one:
///
///     container/isobmff.hpp   readMp4, writeMp4                         the boxes of an .mp4
///     bifs/bifs.hpp           decodeBifs, encodeBifs                    access unit <-> commands
///     bifs/descriptors.hpp    decodeObjectDescriptors, encode...        OD access units, IOD
///     text/bt.hpp, xmt.hpp    readBt, writeBt, readXmt, writeXmt        texts
///
/// The way to an image: ImageTexture.url -> Url::objectDescriptorId -> findObjectDescriptor ->
/// streams[0] -> samples[0].data.load(limits), which is a whole JPEG or PNG file.
// clang-format on
namespace stx::mpeg4 {

/// objectTypeIndication (ISO/IEC 14496-1 table 5) of the streams we know.
namespace oti {
inline constexpr std::uint8_t kSystemsV1 = 0x01;  ///< BIFS with a v1 config, and OD streams
inline constexpr std::uint8_t kSystemsV2 = 0x02;  ///< BIFS with a v2 config
inline constexpr std::uint8_t kAvc = 0x21;
inline constexpr std::uint8_t kHevc = 0x23;
inline constexpr std::uint8_t kJpeg = 0x6C;
inline constexpr std::uint8_t kPng = 0x6D;
}  // namespace oti

/// streamType (ISO/IEC 14496-1 table 6).
enum class StreamType : std::uint8_t {
    none = 0x00,
    objectDescriptor = 0x01,
    clockReference = 0x02,
    sceneDescription = 0x03,
    visual = 0x04,
    audio = 0x05,
    mpeg7 = 0x06,
    ipmp = 0x07,
    objectContentInfo = 0x08,
    mpegJ = 0x09,
    interaction = 0x0A,
};

/// BIFSConfig, the decoder config of a BIFS stream (ISO/IEC 14496-11, 8.5).
struct BifsConfig {
    int version = 1;               ///< 1, or 2 (OTI 2)
    bool use3DMeshCoding = false;  ///< v2
    /// v2: a flag before each MF field; predictive coding itself is refused.
    bool usePredictiveMFField = false;
    int nodeIdBits = 0;  ///< 0..31; writers raise these to what the scene needs
    int routeIdBits = 0;
    int protoIdBits = 0;  ///< v2
    bool isCommandStream = true;
    bool pixelMetric = false;  ///< false: metres
    bool hasSize = false;
    int pixelWidth = 0;  ///< 0..65535
    int pixelHeight = 0;
    bool operator==(const BifsConfig&) const = default;
};

/// One access unit of a media stream.
struct Sample {
    ByteRange data;
    std::uint64_t time = 0;         ///< decoding time in the stream's timescale
    std::uint32_t duration = 1000;  ///< one second at the usual timescale
    std::int32_t compositionOffset = 0;
    bool sync = true;
    bool operator==(const Sample&) const = default;
};

/// One edit of an edit list (ISO/IEC 14496-12, 8.6.6).
struct Edit {
    std::uint64_t duration = 0;    ///< in EditList::timescale
    std::int64_t mediaTime = 0;    ///< in the stream's timescale; -1: nothing is shown
    std::uint32_t rate = 0x10000;  ///< 16.16
    bool operator==(const Edit&) const = default;
};
/// Which parts of a track are shown when; no edits: all of it, from its first sample's time.
struct EditList {
    std::uint32_t timescale = 600;
    std::vector<Edit> edits;
    bool operator==(const EditList&) const = default;
};

/// An ES_Descriptor and the stream it describes.
struct ElementaryStream {
    std::uint32_t esId = 0;  ///< ES_ID of the text forms = track_ID in the file; 0: writers choose
    std::string url;         ///< ES URL: a remote stream; then there are no samples
    std::optional<std::uint16_t> dependsOnEsId;
    std::optional<std::uint16_t> ocrEsId;
    std::uint8_t streamPriority = 0;  ///< 0..31

    std::uint8_t objectTypeIndication = 0;  ///< 0: not known (no DecoderConfigDescriptor)
    StreamType streamType = StreamType::none;
    bool upStream = false;
    std::uint32_t bufferSizeDB = 0;  ///< bytes; 0: writers take the largest sample
    std::uint32_t maxBitrate = 0;
    std::uint32_t avgBitrate = 0;
    Bytes decoderSpecificInfo;  ///< JPEG: 7 bytes, which the writer makes when they are missing

    std::uint32_t timescale = 1000;  ///< ticks a second, at least 1
    std::vector<Sample> samples;
    /// What a delay cannot say: a delay alone is in the times of the samples.
    EditList edits;
    /// Of a track that is neither an image nor an MPEG-4 Systems stream (AVC, HEVC, audio, ...):
    /// its whole sample entry and its handler, which writers of .mp4 write as they are.
    Bytes sampleEntry;
    std::string handler;  ///< four characters; empty: by streamType
    /// How an .mp4 presents the track to players that know no scenes (ISO/IEC 14496-12, 8.3.2):
    /// readers leave these as they are here. No name: one for all images. All tracks are enabled
    /// and none is an alternative to another: a scene needs them all.
    std::string trackName;
    bool inMovie = true;  ///< shown as a picture of its own
    /// Of a visual track as its sample entry says; 0: the writer looks into the image.
    int width = 0, height = 0;
    /// The name of the file that the stream came from or goes to: MuxInfo.fileName, StreamSource
    /// url, or the track's handler name. Never opened by readMp4 or writeMp4.
    std::string fileName;
};

struct ObjectDescriptor {
    int id = 0;       ///< 1..1022
    std::string url;  ///< remote descriptor; then there are no streams
    std::vector<ElementaryStream> streams;
};

/// OD commands (ISO/IEC 14496-1 7.2.5).
struct UpdateObjectDescriptors {
    std::vector<ObjectDescriptor> descriptors;
};
struct RemoveObjectDescriptors {
    std::vector<int> ids;
};
struct UpdateStreams {  ///< ES_DescriptorUpdate
    int objectDescriptorId = 0;
    std::vector<ElementaryStream> streams;
};
struct RemoveStreams {  ///< ES_DescriptorRemove
    int objectDescriptorId = 0;
    std::vector<std::uint32_t> esIds;
};
/// IPMP and unknown commands: passed over by readers of the scene, kept for writing back.
struct OtherOdCommand {
    std::uint8_t tag = 0;
    Bytes body;
};
using OdCommand = std::variant<UpdateObjectDescriptors, RemoveObjectDescriptors, UpdateStreams,
                               RemoveStreams, OtherOdCommand>;
struct OdFrame {
    std::uint64_t time = 0;  ///< in odStream.timescale
    std::vector<OdCommand> commands;
    bool randomAccess = false;  ///< as CommandFrame has it
};

struct InitialObjectDescriptor {
    int id = 1;
    bool includeInlineProfileLevel = false;
    std::string url;
    std::uint8_t odProfileLevel = 0x01;
    std::uint8_t sceneProfileLevel = 0xFE;  ///< 0xFE: none specified, 0xFF: none required
    std::uint8_t audioProfileLevel = 0xFE;
    std::uint8_t visualProfileLevel = 0xFE;
    std::uint8_t graphicsProfileLevel = 0xFE;
};

/// A track as an .mp4 has it, for `info` and `validate`.
struct TrackFacts {
    std::uint32_t trackId = 0;
    std::string handler;      ///< four characters: sdsm, odsm, vide, ...
    std::string sampleEntry;  ///< four characters: mp4s, mp4v, ...
    std::string handlerName;
    std::uint8_t objectTypeIndication = 0;
    std::uint8_t streamType = 0;
    std::size_t sampleCount = 0;
    std::uint64_t bytes = 0;
    bool inIods = false;
    bool referenced = false;  ///< from an OD
    std::uint32_t esIdInEsds = 0;
};

/// How a file differs from what strict readers take; nothing here kept us from reading it.
struct Mp4Deviation {
    enum class Kind {
        noIods,  ///< no IOD: many readers find no scene then
        sceneNotInIods,
        imageInSystemsEntry,  ///< mp4s where mp4v is expected
        imageInNativeEntry,   ///< 'jpeg'/'png ' without esds
        fullEsdInOd,          ///< ES_Descriptor where the file form has ES_ID_Ref
        mpodMissing,          ///< ES_ID_Ref that tref/mpod does not resolve
        streamNotFound,       ///< a descriptor names a track that is not there
        streamOdTag,          ///< tag 0x01 or 0x02 where the file form is 0x11 or 0x10
        noOdTrack,
        esIdNotZero,
        trailingBytes,  ///< after the last command of an access unit
        other,
    };
    Kind kind = Kind::other;
    std::string text;   ///< a sentence
    std::string where;  ///< box path and byte offset
};

/// Deviations beyond these are not recorded.
inline constexpr std::size_t kMaxDeviations = 1000;

struct Mp4Facts {
    std::string majorBrand;  ///< four characters; empty when there is no ftyp
    std::vector<std::string> brands;
    std::uint64_t fileSize = 0;
    bool moovFirst = true;
    bool hasIods = false;
    std::uint32_t movieTimescale = 600;
    std::uint64_t movieDuration = 0;
    std::vector<TrackFacts> tracks;
    std::vector<Mp4Deviation> deviations;
};

/// A presentation.
struct Document {
    InitialObjectDescriptor iod;

    /// The scene: its stream's descriptor, config and commands. readMp4 leaves the access units as
    /// they are in the file in `samples`; writers take `frames` and look at nothing else.
    ElementaryStream sceneStream;
    BifsConfig bifsConfig;
    std::vector<CommandFrame> frames;

    /// The object descriptor stream, likewise.
    ElementaryStream odStream;
    std::vector<OdFrame> odFrames;

    /// How the file looked, when it was an .mp4.
    std::optional<Mp4Facts> mp4;
    /// The folder of the file that it was read from, where its urls that are names are looked for;
    /// empty for none.
    std::filesystem::path folder;

    /// All object descriptors as they are after the frames with time <= `until` (ticks of the OD
    /// stream): updates replace, removals remove. In order of their ids. Pointers into this
    /// document.
    [[nodiscard]] std::vector<const ObjectDescriptor*> objectDescriptors(
        std::uint64_t until = ~std::uint64_t{0}) const;
    /// One of them, null when there is none of that id.
    [[nodiscard]] const ObjectDescriptor* findObjectDescriptor(int id) const;
};

}  // namespace stx::mpeg4

namespace stx {
using Mpeg4Document = mpeg4::Document;
}  // namespace stx
