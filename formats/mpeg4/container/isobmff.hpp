#pragma once

#include "formats/mpeg4/bifs/bifs.hpp"
#include "formats/mpeg4/scene/document.hpp"

/// The MP4 file format (ISO/IEC 14496-12 and -14) around a scene.
namespace stx::mpeg4 {

/// Whether these first bytes of a file look like an ISO base media file.
[[nodiscard]] bool looksLikeMp4(ByteSpan head);

/// Reads the headers, the object descriptors and the scene; the images stay where they are until
/// someone loads their ranges. Unknown boxes, descriptors and tracks are passed over. Errors
/// (invalidInput or unsupported, with the box path and byte offset) on damaged, fragmented and
/// encrypted files and on files without a scene.
[[nodiscard]] Result<Document> readMp4(const ByteSource& source, Job& job);

/// A track by its number, or the first of a kind.
struct TrackChoice {
    std::uint32_t id = 0;
    std::string handler;  ///< "vide", "soun"; empty: by number
};
/// One track of an .mp4 with all its samples, whatever names it: the file needs no scene. Errors as
/// readMp4, and when there is no such track.
[[nodiscard]] Result<ElementaryStream> readMp4Stream(const ByteSource& source,
                                                     const TrackChoice& choice, Job& job);

struct Mp4WriteOptions {
    BifsStyle style;  ///< mask and vector forms
};

/// Writes a document: ftyp, moov, mdat, as strict readers want it: an iods box whose IOD names the
/// scene's track, object descriptors with ES_ID_Ref into tref/mpod, images in mp4v entries with an
/// esds whose ES_ID is 0. Bytes depend on nothing but the document (and SOURCE_DATE_EPOCH, which
/// sets the creation time; 0 without it). Media bytes are copied untouched, and so are the sample
/// entries of streams that have their own (ElementaryStream::sampleEntry). Gives nodes that need
/// one an id, and streams without ES_ID a track. Does not commit `out`. Errors (invalidInput) when
/// the document has something without a code.
[[nodiscard]] Result<void> writeMp4(const Document& document, OutputFile& out, Job& job,
                                    const Mp4WriteOptions& options = {});
/// The same into memory.
[[nodiscard]] Result<Bytes> writeMp4(const Document& document, Job& job,
                                     const Mp4WriteOptions& options = {});

/// A stream alone, as track 1 of a file without a scene. Does not commit `out`.
[[nodiscard]] Result<void> writeMp4Stream(const ElementaryStream& stream, OutputFile& out,
                                          Job& job);

}  // namespace stx::mpeg4
