#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <glm/glm.hpp>

namespace stx {

/// What Assimp's OBJ importer does not report about a material of an MTL file.
struct MtlMaterial {
    bool hasDiffuse = false;                  ///< a Kd line
    bool hasDissolve = false;                 ///< a d line
    bool hasTransparency = false;             ///< a Tr line and no d line
    bool hasEmission = false;                 ///< a Ke line
    std::string diffuseMap, alphaMap;         ///< last word of map_Kd, map_d
    glm::vec2 uvScale{1.0f}, uvOffset{0.0f};  ///< -s and -o of map_Kd; v runs up
    std::vector<std::string> droppedOptions;  ///< "-t of map_Kd", …
};

/// An MTL text as Assimp reads it right: one value of a colour is all three (it would take the
/// others for 0), -halo of d, which it takes for a number, is left out, and -o, -s and -t of maps
/// have u, v and w, of which the last two may be left out (it would take the file's name for one).
[[nodiscard]] std::string plainMtl(std::string_view text);

/// The files that what follows a `mtllib` names. Names may have blanks: one ends with ".mtl".
[[nodiscard]] std::vector<std::string> materialFilesIn(std::string_view line);

/// Adds the materials of one MTL text to `materials`, by name.
void scanMtl(std::string_view text, std::map<std::string, MtlMaterial>& materials);

}  // namespace stx
