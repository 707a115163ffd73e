#pragma once

#include <filesystem>
#include <string>
#include <variant>
#include <vector>

#include "formats/stx/options.hpp"
#include "lib/base/job.hpp"
#include "lib/model/atlas.hpp"
#include "lib/model/bundle.hpp"
#include "lib/model/mesh.hpp"

namespace stx {

/// What a file or folder is, told by its content first and its ending second.
enum class FileKind {
    mesh,      ///< glTF, GLB, OBJ, PLY, STL, DRC
    mpeg4,     ///< .mp4, .xmt, .bt
    exr,       ///< a bundle as multi-part OpenEXR
    atlas,     ///< a folder with atlas.json (or that file), or an atlas .exr
    imageSet,  ///< a calibrated set of images with depth
    image,     ///< a plain picture
    unknown,
};

/// Looks at the name and the first bytes. Errors (io) when there is nothing to read.
[[nodiscard]] Result<FileKind> recognise(const std::filesystem::path& path);
/// "a mesh", "an MPEG-4 file" …
[[nodiscard]] const char* nameOf(FileKind kind);

/// Opens a bundle, an atlas (unpacked) or an image set as a Bundle. Meshes: error that says to use
/// `stx convert`.
[[nodiscard]] Result<Bundle> openBundle(const std::filesystem::path& path,
                                        const OpenOptions& options, Job& job);

/// Opens whatever can be rendered.
[[nodiscard]] Result<std::variant<Mesh, Bundle>> openRenderable(const std::filesystem::path& path,
                                                                const OpenOptions& options,
                                                                Job& job);

/// The container that a target's ending asks for: .exr, .mp4, .xmt or .bt. Errors (usage) for
/// others.
[[nodiscard]] Result<FileKind> containerOf(const std::filesystem::path& target);

/// Writes a bundle whole or not at all, in the container of the target's ending.
[[nodiscard]] Result<void> saveBundle(const Bundle& bundle, const std::filesystem::path& target,
                                      const SaveOptions& options, Job& job);

/// Converts one MPEG-4 file into another container without decoding an image: every stream's bytes
/// pass untouched. False (and nothing written) when this is not such a conversion: another kind of
/// input or target, or options that change pixels.
[[nodiscard]] Result<bool> convertDocument(const std::filesystem::path& input,
                                           const std::filesystem::path& target,
                                           const SaveOptions& options, bool changesDepth, Job& job);

}  // namespace stx
