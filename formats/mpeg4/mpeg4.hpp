#pragma once

#include <filesystem>

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
/// By the first bytes of a file: an ftyp box, XML with <XMT-A, or, behind comments, a word
/// that BT may begin with.
[[nodiscard]] std::optional<Mpeg4Container> mpeg4ContainerOf(ByteSpan head);

/// Of an open file: by its first bytes, and where they do not say it by the ending of its name.
/// Errors: reading.
[[nodiscard]] Result<std::optional<Mpeg4Container>> mpeg4ContainerOf(
    const ByteSource& source, const std::filesystem::path& path);

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

/// Writes a presentation into the container of the path's ending, whole or not at all. Beside a
/// text, or the file that its link leads to, is a folder of its own (mediaFolderName():
/// `name_images` of `name.xmt`) with the streams' bytes, untouched: images as files, all else
/// (needsTrackFile) as an .mp4 with one track. Errors: (usage) another ending, or a text for stdout
/// that has images; (io); what the writers say.
[[nodiscard]] Result<void> writeMpeg4(const Mpeg4Document& document,
                                      const std::filesystem::path& path, Job& job,
                                      const Mpeg4WriteOptions& options = {});

/// Both ways between files and bundles; mapping.hpp has the details.
[[nodiscard]] Result<Bundle> readMpeg4Bundle(const std::filesystem::path& path, Job& job);
/// The same as a table, see mpeg4::viewsFromScene().
[[nodiscard]] Result<std::unique_ptr<ViewTable>> openMpeg4Views(const std::filesystem::path& path,
                                                                Job& job);
/// Views are encoded when they come, by way of a file beside the target. See
/// mpeg4::sceneFromViews(). Coordinates that floats would round count from an origin (originOf()).
[[nodiscard]] Result<void> writeMpeg4Views(const ViewTable& table,
                                           const std::filesystem::path& path, Job& job,
                                           const mpeg4::SceneWriteOptions& scene = {},
                                           const Mpeg4WriteOptions& options = {});

}  // namespace stx
