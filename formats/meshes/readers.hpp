#pragma once

#include "formats/meshes/meshes.hpp"
#include "formats/meshes/model_files.hpp"
#include "formats/meshes/ply_header.hpp"
#include "lib/model/splat_cloud.hpp"

namespace stx {

// One reader per family of formats; readMesh() in meshes.cpp chooses. Contracts as readMesh().

[[nodiscard]] Result<Mesh> readGltf(ByteSpan bytes, ModelFiles& files);
[[nodiscard]] Result<Mesh> readDraco(ByteSpan bytes, ModelFiles& files);

[[nodiscard]] Result<Mesh> readPly(ByteSpan bytes, ModelFiles& files);

[[nodiscard]] Result<Mesh> readOff(ByteSpan bytes, ModelFiles& files);

enum class AssimpFormat { obj, stl, dae, fbx };
/// OBJ, STL, COLLADA and FBX. `fileName` is the model's own name in its folder.
[[nodiscard]] Result<Mesh> readWithAssimp(ByteSpan bytes, AssimpFormat format,
                                          const std::string& fileName, ModelFiles& files);

// Clouds of Gaussians, in splats/.

/// Splats as a file has them: their centres are doubles until it is known what they count from.
struct FileSplats {
    SplatCloud cloud;  ///< its positions come later
    std::vector<glm::dvec3> centres;

    /// As SplatCloud::resize().
    [[nodiscard]] Result<void> resize(std::size_t count, int degree, const Limits& limits);
};

/// A mesh that is drawn as these splats, after dropBroken(). Positions are their centres, from an
/// origin where floats would lose too much (originFor(); a note says so). Points are those that
/// frame it: splats that hide half or more of what is behind them, or, where none does, at least
/// half as much as the one that hides most. Errors: no splat is left, memory over the limit.
[[nodiscard]] Result<Mesh> meshOfSplats(FileSplats splats, Job& job);

/// Whether a PLY file is a cloud of splats: its vertices have opacity, scales, a rotation and a
/// colour of degree 0 (INRIA's names). Without one of these it is a plain point cloud.
[[nodiscard]] bool isSplatPly(const PlyHeader& header);
/// Whether the splats of a PLY file are packed as PlayCanvas does it (.compressed.ply).
[[nodiscard]] bool isPackedSplatPly(const PlyHeader& header);
/// Reads a file of isSplatPly(); values may be of any type. Errors: (invalidInput) lists among the
/// vertices, fewer bytes than vertices, harmonics of no whole degree, memory over the limit;
/// (unsupported) text, other elements before the vertices.
[[nodiscard]] Result<Mesh> readSplatPly(ByteSpan bytes, const PlyHeader& header, Job& job);

/// Reads Niantic's SPZ, versions 2 and 3. Errors: (invalidInput) no gzip, damage, other lengths
/// than the header says; (unsupported) other versions, degrees above 3.
[[nodiscard]] Result<Mesh> readSpz(ByteSpan bytes, Job& job);

}  // namespace stx
