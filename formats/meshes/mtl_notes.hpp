#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <glm/glm.hpp>

namespace stx {

/// What Assimp's OBJ importer does not report about a material of an MTL file.
struct MtlMaterial {
    std::string folder;                       ///< of the file, as plainMtl() was given it
    bool hasDiffuse = false;                  ///< a Kd line
    bool hasDissolve = false;                 ///< a d line
    bool hasTransparency = false;             ///< a Tr line and no d line
    bool hasEmission = false;                 ///< a Ke line
    std::string diffuseMap, alphaMap;         ///< files of map_Kd, map_d
    char alphaChannel = 0;                    ///< -imfchan of map_d: r, g, b, m, l, z; 0: not given
    glm::vec2 uvScale{1.0f}, uvOffset{0.0f};  ///< -s and -o of map_Kd; v runs up
    std::vector<std::string> dropped;         ///< "option -t of map_Kd", "decal", …
};

/// An MTL text for Assimp, and what it takes away of it.
struct PlainMtl {
    /// The lines that a Mesh has a use for, as Assimp reads them right: keywords in Wavefront's
    /// case, colours of three values, maps with the option -clamp only. Other lines may hold what
    /// Assimp stops at.
    std::string text;
    /// "line 3: 'Kd spectral a.rfl 1', expected 'Kd R G B'": lines that have a use, but are not
    /// understood, and are left out.
    std::vector<std::string> unread;
};

/// Adds the materials of an MTL text to `materials`, by name. `folder`: that of the text, relative
/// to the model's; empty when it is the same.
[[nodiscard]] PlainMtl plainMtl(std::string_view text, const std::string& folder,
                                std::map<std::string, MtlMaterial>& materials);

/// The files that what follows a `mtllib` names. Names may have blanks: one ends with ".mtl".
[[nodiscard]] std::vector<std::string> materialFilesIn(std::string_view line);

}  // namespace stx
