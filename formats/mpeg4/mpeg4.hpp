#pragma once

#include <filesystem>
#include <string_view>

#include "formats/files/files.hpp"
#include "formats/mpeg4/bifs/bifs.hpp"
#include "formats/mpeg4/mapping/mapping.hpp"
#include "formats/mpeg4/scene/document.hpp"

/// MPEG-4 presentations as files: .mp4, .bt and .xmt. Between these, convert documents and not
/// bundles: images then keep their bytes.
namespace stx {

enum class Mpeg4Container { mp4, bt, xmt };

/// By the ending (.mp4 .m4v .bt .xmt .xmta, in any case of letters); nothing for others.
[[nodiscard]] std::optional<Mpeg4Container> mpeg4ContainerOf(const std::filesystem::path& path);
/// By the first bytes of a file: an ftyp box, XML with <XMT-A, or BT's words.
[[nodiscard]] std::optional<Mpeg4Container> mpeg4ContainerOf(ByteSpan head);

/// Reads a presentation. The content decides which container it is; where it does not, the ending
/// does. The images of an .mp4 stay in the file; the files that texts name are looked for beside
/// the text (resolveInside) and opened. Errors as the readers', with the file's name.
[[nodiscard]] Result<Mpeg4Document> readMpeg4(const std::filesystem::path& path, Job& job);

struct Mpeg4WriteOptions {
    OutputFile::Options output;
    mpeg4::BifsStyle style;  ///< for .mp4: mask and vector forms
    /// Of the scene's BIFSConfig and its objectTypeIndication: 1 or 2; 0: as the document has it. A
    /// scene with PROTOs always has 2.
    int bifsVersion = 0;
};

/// Writes a presentation into the container of the path's ending, whole or not at all. Beside
/// `name.bt` and `name.xmt` is the folder `name_images` with the streams' bytes, untouched: images
/// as files, all else (needsTrackFile) as an .mp4 with one track.
/// Errors: (usage) another ending, or a text for stdout that has images; (io); what the writers
/// say.
[[nodiscard]] Result<void> writeMpeg4(const Mpeg4Document& document,
                                      const std::filesystem::path& path, Job& job,
                                      const Mpeg4WriteOptions& options = {});

/// Both ways between files and bundles; mapping.hpp has the details.
[[nodiscard]] Result<Bundle> readMpeg4Bundle(const std::filesystem::path& path, Job& job);
[[nodiscard]] Result<void> writeMpeg4Bundle(const Bundle& bundle, const std::filesystem::path& path,
                                            Job& job, const mpeg4::SceneWriteOptions& scene = {},
                                            const Mpeg4WriteOptions& options = {});

namespace mpeg4 {

/// Whether a text has to keep a stream in an .mp4 of its own, named as `file.mp4#1`, which other
/// programs read, too: it has several pictures, or a sample entry or edits of its own.
[[nodiscard]] bool needsTrackFile(const ElementaryStream& stream);

/// Whether pictures of its views are video: H.264 or another coding that needs a decoder of video.
[[nodiscard]] bool holdsVideo(const Document& document);

/// Opens the files that the streams of a document (from a text) name, found in `folder`. Streams
/// that do not say what they are get their type from the file. `name.mp4#3` is track 3 of an .mp4.
/// Errors: (invalidInput) names that leave the folder; (io) files that are not there.
[[nodiscard]] Result<void> loadMedia(Document& document, const std::filesystem::path& folder,
                                     Job& job);

/// In a scene that was made from a bundle, says what the tracks of its images are for: each gets a
/// name, and only colour is in the movie, so that players that know no scenes have no reason to
/// show depth as a video. Other scenes stay as they are.
void nameTracks(Document& document);

/// Names for the files of all streams, each once: their own name where it is a plain one, else what
/// they are for (`front_depth.png`, from the DEF name of the DepthImage), else by object
/// descriptor. In the order of the streams in document.odFrames; empty for streams without samples.
[[nodiscard]] std::vector<std::string> mediaFileNames(const Document& document);

}  // namespace mpeg4
}  // namespace stx
