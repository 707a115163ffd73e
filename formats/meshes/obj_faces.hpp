#pragma once

#include <optional>
#include <set>
#include <string>

#include "formats/files/files.hpp"

namespace stx {

/// What OBJ text says of its faces.
struct ObjFaces {
    /// The materials (`usemtl`) that have, in one object or group, faces without texture
    /// coordinates beside faces with them: Assimp gives the former 0 0.
    std::set<std::string> bareMaterials;
    bool smoothWithoutNormals = false;  ///< it has smoothing groups (`s 1`) and no `vn`
};
[[nodiscard]] ObjFaces objFaces(ByteSpan text);

/// OBJ text that is smoothWithoutNormals, with the normals that its groups ask for, which Assimp
/// does not read: at each vertex of a group the mean of the group's faces by area, in other faces
/// (`s off`) that of the face. Nothing when a line is not understood (then Assimp says what is
/// wrong with it).
[[nodiscard]] std::optional<Bytes> withSmoothNormals(ByteSpan text);

}  // namespace stx
