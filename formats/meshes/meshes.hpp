#pragma once

#include <filesystem>
#include <span>

#include <glm/glm.hpp>

#include "formats/files/files.hpp"
#include "lib/base/job.hpp"
#include "lib/model/mesh.hpp"
#include "lib/model/splat_cloud.hpp"

namespace stx {

/// What a caller knows about a model and the file does not say.
struct MeshOptions {
    /// Base colour texture of all materials, in place of those that the model names (`--texture
    /// FILE`); empty = none. Opened as it is given: the caller named it, not the model.
    std::filesystem::path texture;
    /// glTF's metallic-roughness is read, too; without this its maps are dropped with a note.
    bool materials = false;
};

/// True when the file looks like a model that readMesh() takes: by its first bytes (GLB, glTF, PLY,
/// .drc, FBX, ASCII STL), else by its ending (OBJ, STL, OFF, DAE). `head` is the beginning of the
/// file, 512 bytes are plenty; it may be empty, then only the ending counts.
[[nodiscard]] bool isMesh(const std::filesystem::path& path, ByteSpan head = {});

/// Reads a model: glTF 2.0 and GLB (with Draco, quantisation, sparse accessors, texture transforms,
/// meshopt compression, instances, skins in rest pose, morph targets at their default weights), OBJ
/// with MTL, PLY, STL (ASCII and binary), OFF, COLLADA, FBX, Draco .drc meshes and point clouds.
/// Clouds of Gaussian splats, of PLY, SPZ (2 to 4) and glTF (KHR_gaussian_splatting), become
/// Mesh::splats. "-" reads stdin.
///
/// The result has passed Mesh::check(): world space, all transforms applied, no triangle without
/// area. Lengths are metres in glTF, COLLADA and FBX, whose units are applied (FBX: centimetres
/// times UnitScaleFactor); in other formats they are as written. `normals` is empty when the file
/// has none: a triangle's own normal counts then. Colours of glTF are linear as the standard says;
/// those of OBJ, MTL, PLY, STL and .drc are taken as sRGB, as the programs that write them do, and
/// made linear. A material of a format without the notion is double-sided. Texture names resolve
/// inside the model's folder only; what is named elsewhere is looked for beside the model and in
/// `textures` there.
///
/// What is dropped (animations, lines, cameras, maps other than base colour, emission and normal, a
/// texture that is missing or broken, properties of vertices that are not known, triangles without
/// area) is said with job.note(). A model without any colour becomes grey, with a note.
///
/// Errors: io (missing or unreadable file, missing buffer), invalidInput (a broken rule, named with
/// the object it is in; neither triangles nor points; more than the memory limit), unsupported (a
/// required glTF extension that is not known, or is not drawn and would change what is; glTF 1.0).
[[nodiscard]] Result<Mesh> readMesh(const std::filesystem::path& path, Job& job,
                                    const MeshOptions& options = {});

/// The same for a file in memory. `path` gives the format where the bytes do not, and the folder in
/// which buffers, material files and textures are looked for.
[[nodiscard]] Result<Mesh> readMesh(Bytes bytes, const std::filesystem::path& path, Job& job,
                                    const MeshOptions& options = {});

/// A cloud of points for writePoints(). `colours` and `normals` are empty or as long as
/// `positions`.
struct PointCloud {
    std::span<const glm::vec3> positions;
    std::span<const glm::u8vec4> colours;  ///< sRGB, straight alpha
    std::span<const glm::vec3> normals;    ///< unit
    bool alpha = false;                    ///< write the colours' alpha, too
    glm::dvec3 origin{0.0};                ///< added to the positions, gives the world's
};

/// How writePoints() codes .drc; .ply is always exact (with an origin: world coordinates as
/// doubles; .drc has floats only, so it stays at the origin, with a note).
struct PointWriteOptions {
    int positionBits = 16;  ///< bits per coordinate of the cloud's largest extent, 1..30; 0 = exact
    int normalBits = 10;    ///< bits per component, 2..30; 0 = exact
    OutputFile::Options file = {};
};

/// Writes points as binary little-endian PLY or Draco, by the ending of `path` (.ply or .drc),
/// whole or not at all. The same input gives the same bytes. Quantised .drc may put the points in
/// another order; what is rounded is said with job.note(). Errors: usage (another ending, bits out
/// of range), invalidInput (no points, arrays of unlike length, values that are not finite), io.
[[nodiscard]] Result<void> writePoints(const std::filesystem::path& path, const PointCloud& points,
                                       Job& job, const PointWriteOptions& options = {});

/// What all points of a .ply have, and how many there are.
struct PlyContents {
    std::size_t count = 0;
    bool normals = false, colours = false, alpha = false;
    glm::dvec3 origin{0.0};  ///< as PointCloud::origin
};

/// A .ply whose points come in parts: the bytes of writePoints(), in the memory of a part.
class PlyInParts {
  public:
    /// Errors: invalidInput (no points, or more than a file can hold), io.
    [[nodiscard]] static Result<PlyInParts> create(const std::filesystem::path& path,
                                                   const PlyContents& contents,
                                                   OutputFile::Options options);
    /// The bytes of some points, whose arrays are those that the contents name. Safe from several
    /// threads. Errors: (invalidInput) arrays of unlike length, values that are not finite.
    [[nodiscard]] Result<Bytes> encode(const PointCloud& part) const;
    /// Appends what encode() gave.
    [[nodiscard]] Result<void> add(const Bytes& part);
    /// Errors (invalidInput): there are more or fewer points than was said.
    [[nodiscard]] Result<void> commit();

  private:
    PlyInParts(OutputFile file, const PlyContents& contents)
        : file_(std::move(file)), contents_(contents) {}
    OutputFile file_;
    PlyContents contents_;
    std::size_t bytes_ = 0;  ///< that were added
};

/// Writes a cloud of splats, whole or not at all, by the ending of `path`: .ply (INRIA's binary
/// PLY), .spz (Niantic's version 3) or .glb (KHR_gaussian_splatting, with COLOR_0 for viewers that
/// know only points). What is up in the cloud (SplatCloud::up) is turned to what is up in such
/// files, -Y in PLY and +Y in the others, with a note but for +Y to -Y. Harmonics are left out,
/// with a note. The same input gives the same bytes. What is rounded is said with job.note().
/// Errors: usage (another ending), (invalidInput) coordinates that SPZ's 24 bits do not hold, more
/// than GLB's 4 GiB; memory over the limit, io.
[[nodiscard]] Result<void> writeSplats(const std::filesystem::path& path, SplatCloud cloud,
                                       OutputFile::Options options, Job& job);

}  // namespace stx
