#pragma once

#include "formats/meshes/gltf/gltf_file.hpp"
#include "formats/meshes/readers.hpp"

namespace stx::gltf {

/// The extension's object in a primitive; null: its points are no splats.
[[nodiscard]] Result<const Json*> splatsIn(const Json& primitive, const std::string& where);

/// Reads the splats of a primitive (KHR_gaussian_splatting) as they are in its mesh, behind those
/// that `splats` has. Errors: attributes that are missing or of another length, a kernel or colour
/// space that is not known, unlike colour spaces, memory over the limit.
[[nodiscard]] Result<void> addSplats(GltfFile& model, const Json& primitive,
                                     const std::string& where, FileSplats& splats);

}  // namespace stx::gltf
