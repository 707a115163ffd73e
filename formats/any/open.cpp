#include "formats/any/open.hpp"

#include <algorithm>
#include <fstream>

#include "formats/atlas/atlas_files.hpp"
#include "formats/exr/bundle_exr.hpp"
#include "formats/files/no_case.hpp"
#include "formats/files/not_there.hpp"
#include "formats/files/numbered.hpp"
#include "formats/imagesets/image_sets.hpp"
#include "formats/imagesets/recognise.hpp"
#include "formats/imagesets/set_views.hpp"
#include "formats/meshes/meshes.hpp"
#include "formats/mpeg4/mpeg4.hpp"
#include "formats/photos/photo.hpp"
#include "lib/packing/packing.hpp"

namespace stx {
namespace {

namespace fs = std::filesystem;

/// The first bytes of a file; empty when it cannot be read.
Bytes headOf(const fs::path& path) {
    Bytes head(4096);
    std::ifstream file(path, std::ios::binary);
    file.read(reinterpret_cast<char*>(head.data()), static_cast<std::streamsize>(head.size()));
    head.resize(static_cast<std::size_t>(std::max<std::streamsize>(0, file.gcount())));
    return head;
}

bool startsWith(ByteSpan bytes, std::string_view text, std::size_t at = 0) {
    if (bytes.size() < at + text.size()) return false;
    return std::equal(text.begin(), text.end(), reinterpret_cast<const char*>(bytes.data()) + at);
}

/// Whether a part of it is a view that we wrote.
bool isExrBundleFile(const fs::path& path) {
    const auto reader = ExrReader::open(path, Limits());
    return reader && isExrBundle(*reader);
}

/// Of a name that no file has: whether it is the pattern of a film.
Result<bool> namesFilm(const fs::path& path) {
    if (!frameName(path.string(), 0)) return false;
    STX_CHECK(checkPattern(path.string()));
    auto files = numberedFiles(path.string());
    const bool exr = lowerExtension(path) == ".exr";
    if (exr && !files) return propagate(files);
    return files && (exr || isAtlasFolder(files->front().path));
}

Error isMeshError(const fs::path& path) {
    return {ErrorCode::invalidInput,
            fmt::format(
                "'{0}' is a mesh, not a bundle; make one first: stx convert '{0}' -o bundle.mp4",
                path.string()),
            {}};
}

Error notThere(const fs::path& path) {
    return {
        ErrorCode::io, fmt::format("cannot read '{}': {}", path.string(), whyNotThere(path)), {}};
}

}  // namespace

OpenOptions OpenOptions::into(const fs::path& target) const {
    OpenOptions out = *this;
    out.set.deepColour = set.deepColour || lowerExtension(target) == ".exr";
    out.set.roundFrames = set.roundFrames && !mpeg4ContainerOf(target);
    return out;
}

const char* nameOf(FileKind kind) {
    switch (kind) {
        case FileKind::mesh:
            return "a mesh";
        case FileKind::mpeg4:
            return "an MPEG-4 file";
        case FileKind::exr:
            return "an OpenEXR bundle";
        case FileKind::atlas:
            return "an atlas";
        case FileKind::imageSet:
            return "an image set";
        case FileKind::photo:
        case FileKind::image:
            return "a picture";
        case FileKind::numbered:
            return "a film of numbered files";
        case FileKind::unknown:
            break;
    }
    return "an unknown file";
}

Error unknownInput(const fs::path& path) {
    // It has neither a name nor files beside it.
    if (path == "/dev/stdin")
        return {ErrorCode::invalidInput,
                "standard input is neither a mesh (GLB, glTF, PLY, DRC, binary FBX, STL as text) "
                "nor a bundle or an atlas (.mp4, .xmt, .bt, .exr) nor a photograph with depth; "
                "other meshes, image sets and folders are given by name",
                {}};
    return {ErrorCode::invalidInput,
            fmt::format("'{}' is neither a mesh (glTF, GLB, OBJ, PLY, STL, OFF, DAE, FBX, DRC, "
                        "SPZ) nor a bundle (.mp4, .xmt, .bt, .exr) nor an atlas nor an image set "
                        "nor a photograph with depth",
                        path.string()),
            {}};
}

Result<FileKind> recognise(const fs::path& path) {
    std::error_code ec;
    const auto status = fs::status(path, ec);
    if (path != "-" && !fs::exists(status)) {
        STX_TRY(const bool film, namesFilm(path));
        if (film) return FileKind::numbered;
        return tl::unexpected(notThere(path));
    }
    if (fs::is_directory(status)) {
        if (fs::exists(path / "atlas.json", ec)) return FileKind::atlas;
        return FileKind::imageSet;
    }
    // A pipe whose first bytes were looked at has lost them, or waits for ever.
    if (path != "-" && !fs::is_regular_file(status)) return notAFile(path);
    const auto head = headOf(path);
    const auto ending = lowerExtension(path);
    if (path.filename() == "atlas.json") return FileKind::atlas;
    if (startsWith(head, "\x76\x2f\x31\x01")) {
        const auto reader = ExrReader::open(path, Limits());
        return reader && isExrAtlas(*reader) ? FileKind::atlas : FileKind::exr;
    }
    if (startsWith(head, "\xff\xd8\xff") || photos::isHeif(head)) return FileKind::photo;
    // Matroska: Azure Kinect records in it.
    if (startsWith(head, "\x1a\x45\xdf\xa3")) return FileKind::imageSet;
    if (mpeg4ContainerOf(ByteSpan(head)) || mpeg4ContainerOf(path)) return FileKind::mpeg4;
    // As `stx extract -o NAME.png` writes it; a PNG has no depth itself.
    if (startsWith(head, "\x89PNG"))
        return imagesets::depthBeside(path).empty() ? FileKind::image : FileKind::photo;
    if (isMesh(path, head)) return FileKind::mesh;
    // .freiburg: the lists of camera poses of TUM's and ICL-NUIM's recordings.
    // .log: those of Open3D's.
    if (ending == ".json" || ending == ".txt" || ending == ".freiburg" || ending == ".log")
        return FileKind::imageSet;
    if (ending == ".exr") return FileKind::exr;
    return FileKind::unknown;
}

Result<Bundle> openBundle(const fs::path& path, const OpenOptions& options, Job& job) {
    STX_TRY(auto opened, openRenderable(path, options, job));
    if (std::holds_alternative<Mesh>(opened)) return tl::unexpected(isMeshError(path));
    return std::move(std::get<Bundle>(opened));
}

Result<std::unique_ptr<ViewTable>> openViews(const fs::path& path, const OpenOptions& options,
                                             Job& job) {
    STX_TRY(auto opened, openMeshOrViews(path, options, job));
    if (std::holds_alternative<Mesh>(opened)) return tl::unexpected(isMeshError(path));
    return std::move(std::get<std::unique_ptr<ViewTable>>(opened));
}

Result<std::variant<Mesh, std::unique_ptr<ViewTable>>> openMeshOrViews(const fs::path& path,
                                                                       const OpenOptions& options,
                                                                       Job& job) {
    using Opened = std::variant<Mesh, std::unique_ptr<ViewTable>>;
    STX_TRY(const auto kind, recognise(path));
    if (options.set.from.empty() && (kind == FileKind::exr || kind == FileKind::mpeg4)) {
        STX_CHECK(checkObject(path, kind, options));
        if (kind == FileKind::mpeg4) {
            STX_TRY(auto table, openMpeg4Views(path, job));
            return Opened(std::move(table));
        }
        // What is wrong with another file shows below, where it may be an image set, too.
        if (isExrBundleFile(path)) {
            STX_TRY(auto table, openExrViews(path, job));
            if (table) return Opened(std::move(table));
        }
    }
    if (kind == FileKind::imageSet || !options.set.from.empty()) {
        STX_CHECK(checkObject(path, FileKind::imageSet, options));
        STX_TRY(auto table, openSetViews(path, options.set, job, heldWhole(job.limits)));
        return Opened(std::move(table));
    }
    STX_TRY(auto opened, openRenderable(path, options, job));
    if (auto* mesh = std::get_if<Mesh>(&opened)) return Opened(std::move(*mesh));
    return Opened(tableOf(std::move(std::get<Bundle>(opened))));
}

Result<void> checkObject(const fs::path& path, FileKind kind, const OpenOptions& options) {
    if (options.object.empty() || kind == FileKind::atlas || kind == FileKind::numbered) return {};
    return fail(ErrorCode::usage,
                "'{}' is {}, and only an atlas holds objects with names; leave out --object",
                path.string(), nameOf(kind));
}

Result<Atlas> openAtlas(const fs::path& path, const OpenOptions& options, Job& job) {
    STX_TRY(auto atlas, readAtlas(path, job));
    return within(fmt::format("'{}'", path.string()), objectOf(std::move(atlas), options.object));
}

Result<std::variant<Mesh, Bundle>> openRenderable(const fs::path& path, const OpenOptions& options,
                                                  Job& job) {
    using Opened = std::variant<Mesh, Bundle>;
    STX_TRY(auto kind, recognise(path));
    OpenOptions read = options;
    // Any picture becomes a photograph with depth by a depth picture beside it.
    if (read.set.from.empty() && !read.set.depthPattern.empty() &&
        (kind == FileKind::image || kind == FileKind::unknown))
        read.set.from = "photo";
    if (!read.set.from.empty()) kind = FileKind::imageSet;
    STX_CHECK(checkObject(path, kind, options));
    Result<Bundle> bundle = Bundle();
    switch (kind) {
        case FileKind::mesh: {
            STX_TRY(auto mesh, readMesh(path, job, {options.texture, options.materials}));
            return Opened(std::move(mesh));
        }
        case FileKind::exr:
            bundle = readExrBundle(path, job);
            // Colour and Z in parts of their own, or cameras in a file beside it.
            if (!bundle && bundle.error().code == ErrorCode::invalidInput) {
                auto set = readImageSet(path, options.set, job);
                if (set || !isExrBundleFile(path)) bundle = std::move(set);
            }
            break;
        case FileKind::mpeg4:
            bundle = readMpeg4Bundle(path, job);
            break;
        case FileKind::atlas: {
            STX_TRY(const auto atlas, openAtlas(path, options, job));
            bundle = unpack(atlas, job);
            break;
        }
        case FileKind::imageSet:
        case FileKind::photo:
            bundle = readImageSet(path, read.set, job);
            break;
        case FileKind::numbered: {
            STX_TRY(const auto files, numberedFiles(path.string()));
            if (files.size() > 1)
                job.note(
                    fmt::format("'{}' has {} frames; only the first, '{}', is read (stx render "
                                "--time and --times show the rest)",
                                path.string(), files.size(), files.front().path.string()));
            return openRenderable(files.front().path, options, job);
        }
        case FileKind::image:
            return fail(ErrorCode::invalidInput,
                        "'{}' is a picture, and nothing says where its depth is; name its depth "
                        "picture with --depth FILE",
                        path.string());
        case FileKind::unknown:
            return tl::unexpected(unknownInput(path));
    }
    if (!bundle) return propagate(bundle);
    // Every reader checks what it returns: see Bundle::check().
    return Opened(std::move(*bundle));
}

}  // namespace stx
