#pragma once

#include <map>
#include <string>
#include <vector>

#include "formats/files/files.hpp"

namespace stx {

/// What an FBX file says and Assimp does not, or says by names alone, which need not be unique.
struct FbxFacts {
    struct Model {
        std::string name;
        bool hidden = false;  ///< by itself, by what it is in, or as a lower level of detail
        std::map<std::string, std::size_t> bones;  ///< of its skins, by name: numbers of models
    };
    struct Texture {
        std::string file;  ///< where its relative name is empty, which Assimp takes
        bool clampU = false, clampV = false;
    };
    struct Material {
        double emissiveFactor = 1;
        std::map<std::string, Texture> textures;  ///< by the property that they are connected to
    };
    /// In the order of Assimp's nodes: depth first, children as they are connected.
    std::vector<Model> models;
    std::map<std::string, Material> materials;  ///< by name; the first of each
    std::vector<std::string> lost;              ///< notes on what is not read
};

/// Reads them from an FBX file of version 7. What makes no sense is passed over.
[[nodiscard]] FbxFacts fbxFacts(ByteSpan bytes);

}  // namespace stx
