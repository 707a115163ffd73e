#pragma once

#include <optional>
#include <set>
#include <string>

#include "formats/files/files.hpp"

namespace stx {

/// OBJ text with the normals that its smoothing groups (`s 1`) ask for, which Assimp does not
/// read: at each vertex of a group the mean of the group's faces by area, in other faces (`s off`)
/// that of the face. Nothing when the text has normals (`vn`) or no group, or when a line is not
/// understood (then Assimp says what is wrong with it).
[[nodiscard]] std::optional<Bytes> withSmoothNormals(ByteSpan text);

/// The materials (`usemtl`) of OBJ text that have, in one object or group, faces without texture
/// coordinates beside faces with them: Assimp gives the former 0 0.
[[nodiscard]] std::set<std::string> materialsOfBareFaces(ByteSpan text);

}  // namespace stx
