#pragma once

#include <map>

#include "formats/meshes/gltf/materials.hpp"

namespace stx::gltf {

/// A primitive in its mesh's space, morph targets at the given weights applied.
struct Primitive {
    MeshPart part;
    /// Joint numbers and weights, 4 per vertex for each set JOINTS_n/WEIGHTS_n; empty without skin.
    struct Influence {
        AccessorValues joints;
        AccessorValues weights;
    };
    std::vector<Influence> influences;
    bool drawn = true;  ///< false: lines, which are dropped
};

/// Reads `meshes[m].primitives[p]`. `dropped` counts what is left out, by name.
[[nodiscard]] Result<Primitive> readPrimitive(GltfFile& model, MeshBuilder& builder,
                                              Materials& materials, const Json& primitive,
                                              const std::string& where,
                                              const std::vector<double>& morphWeights,
                                              std::map<std::string, int>& dropped);

}  // namespace stx::gltf
