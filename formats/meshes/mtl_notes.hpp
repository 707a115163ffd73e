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
    std::vector<std::string> droppedOptions;  ///< of map_Kd: -t, -mm, …
};

/// Adds the materials of one MTL text to `materials`, by name.
void scanMtl(std::string_view text, std::map<std::string, MtlMaterial>& materials);

}  // namespace stx
