#pragma once

#include <filesystem>
#include <variant>

#include "formats/any/options.hpp"
#include "lib/base/job.hpp"
#include "lib/model/atlas.hpp"
#include "lib/model/bundle.hpp"
#include "lib/model/mesh.hpp"
#include "lib/model/view_table.hpp"

namespace stx {

/// What a file or folder is, by its content first and its ending second.
enum class FileKind {
    mesh,      ///< glTF, GLB, OBJ, PLY, STL, OFF, DAE, FBX, DRC, SPZ
    mpeg4,     ///< .mp4, .xmt, .bt
    exr,       ///< a bundle as multi-part OpenEXR
    atlas,     ///< a folder with atlas.json (or that file), or an atlas .exr
    imageSet,  ///< a calibrated set of images with depth: a folder or its camera file
    photo,     ///< a JPEG or HEIC, which may hold depth; a PNG with depth beside it
    image,     ///< another plain picture
    numbered,  ///< `name_%04d.exr`, `atlas_%04d`: bundles or atlases, one for each frame
    unknown,
};

/// Looks at the name and the first bytes. Errors (io) when there is nothing to read; (usage) a name
/// with several numbers.
[[nodiscard]] Result<FileKind> recognise(const std::filesystem::path& path);
/// "a mesh", "an MPEG-4 file" …
[[nodiscard]] const char* nameOf(FileKind kind);
/// Of what is nothing that can be opened (invalidInput): says what can be, of standard input what
/// is known by its content alone.
[[nodiscard]] Error unknownInput(const std::filesystem::path& path);

/// Errors (usage): the options name an object, and what is opened is not an atlas.
[[nodiscard]] Result<void> checkObject(const std::filesystem::path& path, FileKind kind,
                                       const OpenOptions& options);

/// Opens a bundle, an atlas (unpacked) or an image set as a Bundle. Meshes: error that says to use
/// `stx convert`.
[[nodiscard]] Result<Bundle> openBundle(const std::filesystem::path& path,
                                        const OpenOptions& options, Job& job);

/// Opens an atlas, or the object of it that the options name (objectOf()).
[[nodiscard]] Result<Atlas> openAtlas(const std::filesystem::path& path, const OpenOptions& options,
                                      Job& job);

/// Opens whatever can be rendered, of numbered files the first, with a note where there are more. A
/// bundle passes Bundle::check(), a mesh Mesh::check().
[[nodiscard]] Result<std::variant<Mesh, Bundle>> openRenderable(const std::filesystem::path& path,
                                                                const OpenOptions& options,
                                                                Job& job);

/// The same; what is not a mesh is a table of views. Those of our OpenEXR bundles, of MPEG-4 and of
/// large image sets are read when they are asked for, all others are in memory.
[[nodiscard]] Result<std::variant<Mesh, std::unique_ptr<ViewTable>>> openMeshOrViews(
    const std::filesystem::path& path, const OpenOptions& options, Job& job);

/// Of a bundle, see openBundle().
[[nodiscard]] Result<std::unique_ptr<ViewTable>> openViews(const std::filesystem::path& path,
                                                           const OpenOptions& options, Job& job);

}  // namespace stx
