#pragma once

#include "formats/meshes/meshes.hpp"
#include "formats/meshes/model_files.hpp"

namespace stx {

// One reader per family of formats; readMesh() in meshes.cpp chooses. Contracts as readMesh().

[[nodiscard]] Result<Mesh> readGltf(ByteSpan bytes, ModelFiles& files);
[[nodiscard]] Result<Mesh> readDraco(ByteSpan bytes, Job& job);

[[nodiscard]] Result<Mesh> readPly(ByteSpan bytes, ModelFiles& files);

[[nodiscard]] Result<Mesh> readOff(ByteSpan bytes, Job& job);

enum class AssimpFormat { obj, stl, dae, fbx };
/// OBJ, STL, COLLADA and FBX. `fileName` is the model's own name in its folder.
[[nodiscard]] Result<Mesh> readWithAssimp(ByteSpan bytes, AssimpFormat format,
                                          const std::string& fileName, ModelFiles& files);

}  // namespace stx
